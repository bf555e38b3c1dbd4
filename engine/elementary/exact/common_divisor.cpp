// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact/common_divisor.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/elementary/exact/fixed.h"

namespace warmfront::roots {
namespace {

// --- Modulo one prime: the degree of a common divisor is at most what it is there ---

constexpr std::uint64_t kPrime = 0xffffffffffffffc5;  // 2^64 - 59

std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  return static_cast<std::uint64_t>(static_cast<Fixed<2>::Whole>(a) * b % kPrime);
}

std::uint64_t inverse(std::uint64_t a) {
  std::uint64_t power = 1;
  for (std::uint64_t e = kPrime - 2; e != 0; e >>= 1) {
    if ((e & 1) != 0) power = times(power, a);
    a = times(a, a);
  }
  return power;
}

using Residues = std::vector<std::uint64_t>;

Residues residues(const Coefficients& p) {
  Residues all(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) all[i] = p[i].residue(kPrime);
  return all;
}

// Certainly without a common divisor but numbers: so modulo a prime that divides neither leading coefficient.
bool surely_coprime(const Coefficients& p, const Coefficients& q) {
  Residues a = residues(p);
  Residues b = residues(q);
  if (a.empty() || b.empty() || a.back() == 0 || b.back() == 0) return false;
  if (a.size() < b.size()) std::swap(a, b);
  while (b.size() > 1) {
    const std::uint64_t lead = inverse(b.back());
    while (a.size() >= b.size()) {
      const std::uint64_t factor = times(a.back(), lead);
      const std::size_t shift = a.size() - b.size();
      for (std::size_t i = 0; i < b.size(); ++i) {
        const std::uint64_t less = times(factor, b[i]);
        std::uint64_t& x = a[i + shift];
        x = x >= less ? x - less : x + (kPrime - less);
      }
      while (!a.empty() && a.back() == 0) a.pop_back();
    }
    if (a.empty()) return false;  // b divides what was before it
    std::swap(a, b);
  }
  return true;
}

// --- Over the integers ---

// Divided by the largest power of two, and by the common divisor of all coefficients if these are short.
void make_small(Coefficients& p) {
  int twos = Big::kMaxShift;
  int longest = 0;
  for (const Big& x : p) {
    if (x.sign() != 0) twos = std::min(twos, x.trailing_zeros());
    longest = std::max(longest, x.bits());
  }
  if (longest == 0) return;
  for (Big& x : p) x = x >> twos;
  if (longest > Big::kMostDivisorBits) return;
  Big content;
  for (const Big& x : p) content = odd_divisor(content, x);
  if (content.bits() <= 1) return;
  for (Big& x : p) x = exact_quotient(x, content);
}

// A multiple of a polynomial with content, of long numbers, becomes one of short ones: `lead` is a multiple
// of the leading coefficient of the one without content.
void shorten(Coefficients& p, const Big& lead) {
  const Big by = p.back();
  for (Big& x : p) x = exact_quotient(x * lead, by);
  make_small(p);
}

// Of a, b; or one of them, where they are long.
Big common_lead(const Big& a, const Big& b) {
  if (a.bits() > Big::kMostDivisorBits) return b;
  return b.bits() > Big::kMostDivisorBits
             ? a
             : odd_divisor(a, b) << std::min(a.trailing_zeros(), b.trailing_zeros());
}

void normalise(Coefficients& p) {
  while (!p.empty() && p.back().sign() == 0) p.pop_back();
}

// lead(b)^(degree(a) - degree(b) + 1) a mod b; a is of no lower degree.
Coefficients pseudo_remainder(Coefficients a, const Coefficients& b) {
  const Big& lead = b.back();
  for (std::size_t left = a.size() - b.size() + 1; left > 0; --left) {
    const Big top = a.back();
    const std::size_t shift = left - 1;
    for (Big& x : a) x = x * lead;
    for (std::size_t i = 0; i < b.size(); ++i) a[i + shift] = a[i + shift] - top * b[i];
    a.pop_back();  // 0 by construction
  }
  normalise(a);
  return a;
}

Big power(const Big& x, int exponent) {
  Big result(1);
  for (int i = 0; i < exponent; ++i) result = result * x;
  return result;
}

// q with a = q b up to a factor; b divides a. With b = k c, c without content, a / c is integral, and its
// leading coefficient divides that of a (Gauss).
Coefficients quotient(Coefficients a, const Coefficients& b) {
  const Big& lead = b.back();
  const Big lead_of_a = a.back();
  Coefficients result(a.size() - b.size() + 1, Big(0));
  for (std::size_t left = result.size(); left > 0; --left) {
    const std::size_t shift = left - 1;
    const Big top = a[shift + b.size() - 1];
    for (Big& x : result) x = x * lead;
    result[shift] = top;
    for (Big& x : a) x = x * lead;
    for (std::size_t i = 0; i < b.size(); ++i) a[i + shift] = a[i + shift] - top * b[i];
  }
  shorten(result, lead_of_a);
  return result;
}

}  // namespace

Coefficients common_divisor(const Coefficients& p, const Coefficients& q) {
  Coefficients a = p;
  Coefficients b = q;
  if (a.size() < b.size()) std::swap(a, b);
  if (b.empty()) return a;
  if (b.size() == 1 || surely_coprime(a, b)) return {Big(1)};
  make_small(a);
  make_small(b);
  // That of a divisor without content divides both (Gauss).
  const Big lead = common_lead(a.back(), b.back());
  // The divisors g h^delta and h of Brown and Traub; of either sign, since only divisors are asked for.
  Big g(1);
  Big h(1);
  for (;;) {
    const int delta = degree(a) - degree(b);
    Coefficients rest = pseudo_remainder(a, b);
    if (rest.empty()) break;
    if (rest.size() == 1) return {Big(1)};
    const Big divisor = g * power(h, delta);
    a = std::move(b);
    for (Big& x : rest) x = exact_quotient(x, divisor);
    b = std::move(rest);
    g = a.back();
    if (delta > 0) h = delta == 1 ? g : exact_quotient(power(g, delta), power(h, delta - 1));
  }
  shorten(b, lead);
  return b;
}

Coefficients squarefree(const Coefficients& p) {
  if (p.size() <= 2) return p;
  const Coefficients common = common_divisor(p, derivative(p));
  return common.size() == 1 ? p : quotient(p, common);
}

}  // namespace warmfront::roots
