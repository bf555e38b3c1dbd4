// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact/big.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace warmfront {
namespace {

// For longer operands GMP may use multiplication algorithms that allocate temporary space on the heap.
constexpr std::size_t kLongest = 1024;

mp_size_t size_of(const std::vector<mp_limb_t>& limbs) {
  return static_cast<mp_size_t>(limbs.size());
}

int compare(const std::vector<mp_limb_t>& a, const std::vector<mp_limb_t>& b) {
  if (a.size() != b.size()) return a.size() < b.size() ? -1 : 1;
  return a.empty() ? 0 : mpn_cmp(a.data(), b.data(), size_of(a));
}

}  // namespace

Big::Big(std::int64_t value) : negative_(value < 0) {
  const auto bits = static_cast<std::uint64_t>(value);
  if (value != 0) limbs_.push_back(negative_ ? -bits : bits);
}

Big Big::of(Limbs limbs, bool negative) {
  while (!limbs.empty() && limbs.back() == 0) limbs.pop_back();
  Big result;
  result.limbs_ = std::move(limbs);
  result.negative_ = negative;
  return result;
}

Big Big::operator-() const {
  Big negated = *this;
  negated.negative_ = !negative_;
  return negated;
}

Big Big::sum(const Big& a, const Big& b, bool b_negative) {
  const bool a_first = compare(a.limbs_, b.limbs_) >= 0;
  const Limbs& more = a_first ? a.limbs_ : b.limbs_;
  const Limbs& less = a_first ? b.limbs_ : a.limbs_;
  const bool negative = a_first ? a.negative_ : b_negative;
  if (less.empty()) return of(more, negative);
  Limbs result(more.size() + 1);
  if (a.negative_ == b_negative) {
    result.back() = mpn_add(result.data(), more.data(), size_of(more), less.data(), size_of(less));
  } else {
    mpn_sub(result.data(), more.data(), size_of(more), less.data(), size_of(less));
  }
  return of(std::move(result), negative);
}

Big& Big::operator+=(const Big& b) {
  if (this == &b || compare(limbs_, b.limbs_) < 0) return *this = *this + b;
  if (b.limbs_.empty()) return *this;
  if (negative_ == b.negative_) {
    const mp_limb_t carry =
        mpn_add(limbs_.data(), limbs_.data(), size_of(limbs_), b.limbs_.data(), size_of(b.limbs_));
    if (carry != 0) limbs_.push_back(carry);
  } else {
    mpn_sub(limbs_.data(), limbs_.data(), size_of(limbs_), b.limbs_.data(), size_of(b.limbs_));
    while (!limbs_.empty() && limbs_.back() == 0) limbs_.pop_back();
  }
  return *this;
}

Big Big::product(const Big& a, const Big& b) {
  const bool a_first = a.limbs_.size() >= b.limbs_.size();
  const Limbs& more = a_first ? a.limbs_ : b.limbs_;
  const Limbs& less = a_first ? b.limbs_ : a.limbs_;
  if (less.empty()) return {};
  Limbs result(more.size() + less.size());
  if (less.size() <= kLongest) {
    mpn_mul(result.data(), more.data(), size_of(more), less.data(), size_of(less));
  } else {
    for (std::size_t i = 0; i < less.size(); ++i)
      result[i + more.size()] = mpn_addmul_1(result.data() + i, more.data(), size_of(more), less[i]);
  }
  return of(std::move(result), a.negative_ != b.negative_);
}

Big Big::times(const Big& a, std::uint64_t b) {
  if (a.limbs_.empty()) return {};
  Limbs result(a.limbs_.size() + 1);
  result.back() = mpn_mul_1(result.data(), a.limbs_.data(), size_of(a.limbs_), b);
  return of(std::move(result), a.negative_);
}

Big Big::shifted_up(const Big& a, int bits) {
  if (a.limbs_.empty()) return {};
  const auto whole = static_cast<std::size_t>(bits / 64);
  const auto rest = static_cast<unsigned>(bits % 64);
  Limbs result(whole + a.limbs_.size() + 1);
  if (rest == 0) {
    std::ranges::copy(a.limbs_, result.begin() + static_cast<std::ptrdiff_t>(whole));
  } else {
    result.back() = mpn_lshift(result.data() + whole, a.limbs_.data(), size_of(a.limbs_), rest);
  }
  return of(std::move(result), a.negative_);
}

Big Big::shifted_down(const Big& a, int bits) {
  const auto whole = std::min(static_cast<std::size_t>(bits / 64), a.limbs_.size());
  const auto rest = static_cast<unsigned>(bits % 64);
  const auto begin = a.limbs_.begin() + static_cast<std::ptrdiff_t>(whole);
  bool lost = std::any_of(a.limbs_.begin(), begin, [](mp_limb_t limb) { return limb != 0; });
  Limbs result(begin, a.limbs_.end());
  if (rest != 0 && !result.empty())
    lost |= mpn_rshift(result.data(), result.data(), size_of(result), rest) != 0;
  Big shifted = of(std::move(result), a.negative_);
  if (lost && a.negative_) shifted.add_one_to_magnitude();
  return shifted;
}

Big Big::quotient(const Big& a, const Big& b) {
  const bool negative = a.negative_ != b.negative_;
  Big result;
  bool lost = !a.limbs_.empty();
  if (a.limbs_.size() >= b.limbs_.size()) {
    Limbs quotient(a.limbs_.size() - b.limbs_.size() + 1);
    Limbs remainder(b.limbs_.size());
    mpn_tdiv_qr(quotient.data(), remainder.data(), 0, a.limbs_.data(), size_of(a.limbs_), b.limbs_.data(),
                size_of(b.limbs_));
    result.limbs_ = of(std::move(quotient), false).limbs_;
    lost = std::ranges::any_of(remainder, [](mp_limb_t limb) { return limb != 0; });
  }
  result.negative_ = negative;
  if (lost && negative) result.add_one_to_magnitude();
  return result;
}

Big Big::root(const Big& a) {
  if (a.limbs_.empty()) return {};
  Limbs result((a.limbs_.size() + 1) / 2);
  mpn_sqrtrem(result.data(), nullptr, a.limbs_.data(), size_of(a.limbs_));
  return of(std::move(result), false);
}

// From the lowest limb up, modulo 2^64 each (Jebelean 1993): the quotient's limbs in turn make the rest's
// lowest limb 0.
Big Big::exact(const Big& a, const Big& b) {
  if (a.limbs_.empty()) return {};
  const int zeros = b.trailing_zeros();
  const Big odd = shifted_down(b.negative_ ? -b : b, zeros);
  Limbs rest = shifted_down(a.negative_ ? -a : a, zeros).limbs_;
  const mp_limb_t low = odd.limbs_.front();
  mp_limb_t inverse = low;  // right in three bits; each round doubles that
  for (int round = 0; round < 5; ++round) inverse *= 2 - low * inverse;
  const std::size_t width = odd.limbs_.size();
  Limbs result(rest.size() - width + 1);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = rest[i] * inverse;
    const std::size_t reach = std::min(width, rest.size() - i);
    mp_limb_t borrow =
        mpn_submul_1(rest.data() + i, odd.limbs_.data(), static_cast<mp_size_t>(reach), result[i]);
    for (std::size_t k = i + reach; k < rest.size() && borrow != 0; ++k) {
      const mp_limb_t before = rest[k];
      rest[k] -= borrow;
      borrow = before < borrow ? 1 : 0;
    }
  }
  return of(std::move(result), a.negative_ != b.negative_);
}

Big Big::divisor(const Big& a, const Big& b) {
  const auto odd = [](const Big& x) {
    return x.limbs_.empty() ? Big() : shifted_down(x.negative_ ? -x : x, x.trailing_zeros());
  };
  Big x = odd(a);
  Big y = odd(b);
  if (compare(x.limbs_, y.limbs_) < 0) std::swap(x, y);
  if (y.limbs_.empty()) return x;
  Limbs result(y.limbs_.size());
  result.resize(static_cast<std::size_t>(
      mpn_gcd(result.data(), x.limbs_.data(), size_of(x.limbs_), y.limbs_.data(), size_of(y.limbs_))));
  return of(std::move(result), false);
}

int Big::trailing_zeros() const {
  const auto low = std::ranges::find_if(limbs_, [](mp_limb_t limb) { return limb != 0; });
  return 64 * static_cast<int>(low - limbs_.begin()) + std::countr_zero(*low);
}

std::uint64_t Big::residue(std::uint64_t m) const {
  if (limbs_.empty()) return 0;
  const std::uint64_t rest = mpn_mod_1(limbs_.data(), size_of(limbs_), m);
  return negative_ && rest != 0 ? m - rest : rest;
}

void Big::add_one_to_magnitude() {
  limbs_.push_back(0);
  mpn_add_1(limbs_.data(), limbs_.data(), size_of(limbs_), 1);
  if (limbs_.back() == 0) limbs_.pop_back();
}

int Big::bits() const {
  return limbs_.empty() ? 0 : 64 * static_cast<int>(limbs_.size()) - std::countl_zero(limbs_.back());
}

double Big::scaled(int shift) const {
  if (limbs_.empty()) return 0;
  // The highest 64 bits, truncated to the 53 of a double.
  const int zeros = std::countl_zero(limbs_.back());
  mp_limb_t top = limbs_.back() << zeros;
  if (zeros > 0 && limbs_.size() > 1) top |= limbs_[limbs_.size() - 2] >> (64 - zeros);
  const double magnitude = std::ldexp(static_cast<double>(top & ~mp_limb_t{0x7ff}), bits() - 64 - shift);
  return negative_ ? -magnitude : magnitude;
}

double Big::floor_scaled(int shift) const {
  // Truncated to a multiple of 2^-1074 and to 53 bits, so that scaling is exact.
  if (shift > 1074) return (*this >> (shift - 1074)).floor_scaled(1074);
  return scaled(shift);
}

}  // namespace warmfront
