// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact/isolated_roots.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "engine/elementary/exact/common_divisor.h"

namespace warmfront::roots {
namespace {

BigDyadic with_shift(const BigDyadic& t, int shift) {
  return {t.numerator << (shift - t.shift), shift};
}

BigDyadic middle_of(const BigDyadic& a, const BigDyadic& b) {
  const int shift = std::max(a.shift, b.shift);
  return {with_shift(a, shift).numerator + with_shift(b, shift).numerator, shift + 1};
}

// Sign of a - b.
int order(const BigDyadic& a, const BigDyadic& b) {
  const int shift = std::max(a.shift, b.shift);
  return (with_shift(a, shift).numerator - with_shift(b, shift).numerator).sign();
}

// p(t) 2^(degree * t.shift).
Big scaled_value(const Coefficients& p, const BigDyadic& t) {
  if (p.empty()) return {};
  Big value = p.back();
  for (int i = degree(p); i-- > 0;) value = value * t.numerator + (p[i] << ((degree(p) - i) * t.shift));
  return value;
}

int sign_of(const Coefficients& p, const BigDyadic& t) {
  return scaled_value(p, t).sign();
}

// Of p on [begin, end], times a positive number: b_i = sum over k <= i of C(i, k) / C(n, k) q_k for q(x) =
// p(begin + (end - begin) x).
Coefficients bernstein(const Coefficients& p, const BigDyadic& begin, const BigDyadic& end) {
  const int shift = std::max(begin.shift, end.shift);
  const Big from = with_shift(begin, shift).numerator;
  const Big by = with_shift(end, shift).numerator - from;
  const int n = degree(p);
  Coefficients q{p.back()};
  for (int i = n; i-- > 0;) {
    Coefficients next(q.size() + 1, Big(0));
    for (std::size_t k = 0; k < q.size(); ++k) {
      next[k] = next[k] + q[k] * from;
      next[k + 1] = next[k + 1] + q[k] * by;
    }
    next[0] = next[0] + (p[i] << ((n - i) * shift));
    q = std::move(next);
  }
  // n! C(i, k) / C(n, k) = n! i! (n - k)! / (n! (i - k)!) is an integer.
  const auto factorial = [](int x) {
    std::uint64_t product = 1;
    for (int i = 2; i <= x; ++i) product *= static_cast<std::uint64_t>(i);
    return product;
  };
  Coefficients b(q.size(), Big(0));
  for (int i = 0; i <= n; ++i) {
    for (int k = 0; k <= i; ++k) b[i] = b[i] + q[k] * (factorial(i) / factorial(i - k) * factorial(n - k));
  }
  return b;
}

int variations(const Coefficients& b) {
  int count = 0;
  int last = 0;
  for (const Big& x : b) {
    const int sign = x.sign();
    count += sign * last < 0;
    if (sign != 0) last = sign;
  }
  return count;
}

// de Casteljau at the middle, times 2^n: `left` becomes the first half, and the second is returned.
Coefficients halve(Coefficients& left) {
  const std::size_t n = left.size() - 1;
  Coefficients right(left.size());
  Coefficients row = left;
  for (std::size_t level = 0; level <= n; ++level) {
    left[level] = row[0] << static_cast<int>(n - level);
    right[n - level] = row[n - level] << static_cast<int>(n - level);
    for (std::size_t i = 0; i + level < n; ++i) row[i] += row[i + 1];
  }
  return right;
}

struct Piece {
  Coefficients bernstein;
  BigDyadic begin;
  BigDyadic end;
  int depth = 0;          // halvings
  bool only_end = false;  // a root at the end of what was before
};

// Halvings before two roots that stay together count as close: most are apart sooner, at less cost.
constexpr int kPatience = 4;

// The interval of the only root of f, at whose ends f has two signs. Quadratic interval refinement (Abbott,
// "Quadratic interval refinement for real roots", 2006): the secant names one of N parts; if it is right, the
// next N is N^2, if not, its root; with two parts it is bisection.
class Refinement {
 public:
  Refinement(const Coefficients& f, BigDyadic begin, BigDyadic end)
      : f_(f), begin_(std::move(begin)), end_(std::move(end)), before_(sign_of(f, begin_)) {}

  const BigDyadic& begin() const { return begin_; }
  const BigDyadic& end() const { return end_; }
  bool is_root() const { return found_; }  // begin() = end(), the root

  void shorten() {
    const int shift = std::max(begin_.shift, end_.shift);
    begin_ = with_shift(begin_, shift);
    end_ = with_shift(end_, shift);
    const Big width = end_.numerator - begin_.numerator;
    const Big at_begin = scaled_value(f_, begin_);
    const Big drop = at_begin - scaled_value(f_, end_);
    const Big one(1);
    const Big last = (one << log_parts_) - one;
    // The part is only a guess: of long numbers, the leading bits do.
    const int spare = std::max(0, drop.bits() - (log_parts_ + 64));
    Big named = (floor_divide((at_begin >> spare) << (log_parts_ + 1), drop >> spare) + one) >> 1;
    if ((named - one).sign() < 0) named = one;
    if ((last - named).sign() < 0) named = last;
    const auto grid = [&](const Big& i) {
      return BigDyadic{(begin_.numerator << log_parts_) + width * i, shift + log_parts_};
    };
    BigDyadic at = grid(named);
    const int sign = sign_of(f_, at);
    if (sign == 0) return meet(std::move(at));
    const bool root_after = sign == before_;
    BigDyadic other = grid(root_after ? named + one : named - one);
    const int other_sign = sign_of(f_, other);
    if (other_sign == 0) return meet(std::move(other));
    const bool right = (other_sign == before_) != root_after;
    if (root_after) {
      begin_ = std::move(right ? at : other);
      if (right) end_ = std::move(other);
    } else {
      end_ = std::move(right ? at : other);
      if (right) begin_ = std::move(other);
    }
    log_parts_ = right ? std::min(2 * log_parts_, kMostLogParts) : std::max(log_parts_ / 2, 1);
  }

 private:
  static constexpr int kMostLogParts = 4096;

  void meet(BigDyadic root) {
    begin_ = root;
    end_ = std::move(root);
    found_ = true;
  }

  const Coefficients& f_;
  BigDyadic begin_;
  BigDyadic end_;
  int before_;
  int log_parts_ = 2;
  bool found_ = false;
};

// f has the sign `outside` at both ends of an interval in which it has one critical point, where it is not 0.
// A time at which it has the other sign: between its only two roots. None: it has no root there.
std::optional<BigDyadic> between_two_roots(const Coefficients& f, const BigDyadic& begin,
                                           const BigDyadic& end, int outside) {
  const Coefficients slope = derivative(f);
  Refinement critical(slope, begin, end);
  for (;; critical.shorten()) {
    const int at_begin = sign_of(f, critical.begin());
    if (at_begin == -outside) return critical.begin();
    if (critical.is_root()) return {};
    const int at_end = sign_of(f, critical.end());
    if (at_end == -outside) return critical.end();
    if (at_begin == 0 || at_end == 0) continue;
    // f falls, or rises, up to begin() and from end() on: without a root in between it has none.
    if (variations(bernstein(f, critical.begin(), critical.end())) == 0) return {};
  }
}

// Whether f has exactly one critical point within the piece, by Descartes' rule, and none at its ends.
bool one_critical_point(const Coefficients& bernstein) {
  Coefficients slope;
  for (std::size_t i = 1; i < bernstein.size(); ++i) slope.push_back(bernstein[i] - bernstein[i - 1]);
  return slope.front().sign() != 0 && slope.back().sign() != 0 && variations(slope) == 1;
}

constexpr int kPadded = 6;

Polynomial<Big, kPadded> padded(const Coefficients& p) {
  Polynomial<Big, kPadded> all;
  std::ranges::copy(p, all.c.begin());
  return all;
}

}  // namespace

void isolate_roots(const Coefficients& f, const BigDyadic& begin, const BigDyadic& end,
                   const std::function<bool(const IsolatedRoot&)>& visit) {
  if (f.size() < 2) return;
  if (sign_of(f, begin) == 0 && !visit({begin, begin, true})) return;
  if (order(begin, end) == 0) return;
  std::vector<Piece> pieces;
  pieces.push_back({{}, end, end, 0, true});
  pieces.push_back({bernstein(f, begin, end), begin, end});
  while (!pieces.empty()) {
    Piece piece = std::move(pieces.back());
    pieces.pop_back();
    if (piece.only_end) {
      if (sign_of(f, piece.end) == 0 && !visit({piece.end, piece.end, true})) return;
      continue;
    }
    const int count = variations(piece.bernstein);
    if (count == 0) continue;
    const bool ends_apart = piece.bernstein.front().sign() != 0 && piece.bernstein.back().sign() != 0;
    if (count == 1 && ends_apart) {
      if (!visit({piece.begin, piece.end, false})) return;
      continue;
    }
    // Bisection would take a step for each bit of the distance of two close roots, or complex ones.
    if (count == 2 && ends_apart && piece.depth >= kPatience && one_critical_point(piece.bernstein)) {
      const auto between = between_two_roots(f, piece.begin, piece.end, piece.bernstein.front().sign());
      if (between && (!visit({piece.begin, *between, false}) || !visit({*between, piece.end, false}))) return;
      continue;
    }
    const BigDyadic middle = middle_of(piece.begin, piece.end);
    Coefficients right = halve(piece.bernstein);
    const bool at_middle = right.front().sign() == 0;
    const int depth = piece.depth + 1;
    pieces.push_back({std::move(right), middle, piece.end, depth});
    if (at_middle) pieces.push_back({{}, middle, middle, depth, true});
    pieces.push_back({std::move(piece.bernstein), std::move(piece.begin), middle, depth});
  }
}

double floor_of_root(const Coefficients& f, const IsolatedRoot& root) {
  if (root.is_dyadic) return floor_of(root.begin);
  return locate(padded(f), root.begin, root.end, sign_of(f, root.begin), nullptr)->floor;
}

int sign_at_root(const Coefficients& f, const IsolatedRoot& root, const Coefficients& g) {
  if (g.empty()) return 0;
  if (root.is_dyadic) return sign_of(g, root.begin);
  // f changes its sign at the root; a common divisor does if it has the root.
  const Coefficients common = common_divisor(f, g);
  if (common.size() > 1 && sign_of(common, root.begin) != sign_of(common, root.end)) return 0;
  // g is not 0 at the root: nor, then, on a short interval around it.
  for (Refinement around(f, root.begin, root.end);; around.shorten()) {
    if (around.is_root()) return sign_of(g, around.begin());
    const Coefficients b = bernstein(g, around.begin(), around.end());
    if (b.front().sign() != 0 && b.back().sign() != 0 && variations(b) == 0) return b.front().sign();
  }
}

}  // namespace warmfront::roots
