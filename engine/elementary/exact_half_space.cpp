// SPDX-License-Identifier: Apache-2.0
// In integers: f = n . (x - p), and with a separation s, while f > 0, f^2 - s^2 |n|^2. Where both are above 0
// at t = 0, f cannot reach 0 before the latter does.
#include "engine/elementary/exact_half_space.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <initializer_list>
#include <optional>

#include "engine/elementary/exact/common_divisor.h"
#include "engine/elementary/exact/isolated_roots.h"
#include "engine/elementary/exact_polygon.h"
#include "engine/elementary/near_polygon.h"

namespace warmfront {
namespace {

/// The exponents of the lowest bit that is set in any of some doubles, and of a power of two above all of
/// them.
class Exponents {
 public:
  void add(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x) << 1;
    if (bits == 0) return;
    const auto exponent = static_cast<int>(bits >> 53);
    const int zeros = std::min(52, std::countr_zero(bits) - 1);
    least_ = std::min(least_, std::max(exponent, 1) - 1075 + zeros);
    greatest_ = std::max(greatest_, std::max(exponent, 1) - 1022);
  }
  /// Of a unit of which all are multiples.
  int least() const { return any() ? least_ : 0; }
  int span() const { return any() ? greatest_ - least_ : 0; }

 private:
  bool any() const { return greatest_ >= least_; }

  int least_ = 4096;
  int greatest_ = -4096;
};

/// The pair's numbers. Axes along which the normal has nothing at either end do not count.
struct Numbers {
  const VertexMotion& vertex;
  const HalfSpaceMotion& half_space;
  double separation;
  Exponents lengths;
  Exponents normals;

  Numbers(const VertexMotion& the_vertex, const HalfSpaceMotion& the_half_space, double the_separation)
      : vertex(the_vertex), half_space(the_half_space), separation(the_separation) {
    lengths.add(separation);
    for (std::size_t k = 0; k < 3; ++k) {
      if (!counts(k)) continue;
      for (const double x : {vertex.t0[k], vertex.t1[k], half_space.point[0][k], half_space.point[1][k]})
        lengths.add(x);
      for (const auto& n : half_space.normal) normals.add(n[k]);
    }
  }
  bool counts(std::size_t axis) const {
    return half_space.normal[0][axis] != 0 || half_space.normal[1][axis] != 0;
  }
};

bool is_finite(const VertexMotion& vertex, const HalfSpaceMotion& half_space, double separation) {
  bool finite = std::isfinite(separation);
  for (std::size_t k = 0; k < 3; ++k) {
    finite = finite && std::isfinite(vertex.t0[k]) && std::isfinite(vertex.t1[k]);
    for (std::size_t end = 0; end < 2; ++end)
      finite = finite && std::isfinite(half_space.point[end][k]) && std::isfinite(half_space.normal[end][k]);
  }
  return finite;
}

/// Integers of one width. With lengths and normals below 2^k, k = 64 W - 4, differences of two are below
/// 2^(k+1), and of these 2^(k+2): f has coefficients below 3 2^(2k+1), 3 2^(2k+3) and 3 2^(2k+3), in all
/// below 2^(128 W - 1.2); where n does not turn, of f^2 - s^2 |n|^2 all are below 2^(4k+9) = 2^(256 W - 7).
/// So they fit in 2 W and 4 W limbs, which also satisfies evaluate() and discriminant_sign().
template <int kWords>
struct OfWidth {
  using Linear = Fixed<kWords>;
  static bool fits(const Numbers& numbers) {
    return std::max(numbers.lengths.span(), numbers.normals.span()) <= 64 * kWords - 4;
  }
};
struct OfAnyWidth {
  using Linear = Big;
};

/// The largest double not above the first root in (0, 1] of p, which is above 0 at 0; 2 without one. None:
/// Fixed is too narrow.
template <class Int>
std::optional<double> first_root(const Polynomial<Int, 2>& p) {
  double first = 2;
  const Answer answer = visit_roots(p, [&](const auto&, const auto& root) {
    first = root.floor;
    return Answer::kYes;
  });
  if (answer == Answer::kUnknown) return {};
  return first;
}
double first_root(const Polynomial<Big, 4>& p) {
  const roots::Coefficients f = roots::squarefree(roots::coefficients(p));
  double first = 2;
  roots::isolate_roots(f, dyadic_of<BigDyadic>(0), dyadic_of<BigDyadic>(1),
                       [&](const roots::IsolatedRoot& root) {
                         first = roots::floor_of_root(f, root);
                         return false;
                       });
  return first;
}

Verdict at_root(double toi) {
  return toi <= 1 ? Verdict::at(toi, ContactStatus::kHit) : Verdict{};
}

// None: Fixed is too narrow.
template <class Width>
std::optional<Verdict> decide(const Numbers& numbers) {
  using Linear = typename Width::Linear;
  using Moving = Polynomial<Linear, 1>;
  const auto length = [&](double x) { return integer_of<Linear>(x, numbers.lengths.least()); };
  const auto normal = [&](double x) { return integer_of<Linear>(x, numbers.normals.least()); };
  const auto& [point, normals] = numbers.half_space;
  const Moving none{{Linear(0), Linear(0)}};
  auto f = none * none;
  auto square = f;  // |n|^2
  for (std::size_t k = 0; k < 3; ++k) {
    if (!numbers.counts(k)) continue;
    const Linear d0 = length(numbers.vertex.t0[k]) - length(point[0][k]);
    const Linear d1 = length(numbers.vertex.t1[k]) - length(point[1][k]);
    const Linear n0 = normal(normals[0][k]);
    const Moving n{{n0, normal(normals[1][k]) - n0}};
    f = f + n * Moving{{d0, d1 - d0}};
    if (numbers.separation > 0) square = square + n * n;
  }
  if (f.c[0].sign() <= 0) return Verdict::at(0, ContactStatus::kHit);
  const auto verdict_of = [](const std::optional<double>& toi) {
    return toi ? std::optional(at_root(*toi)) : std::nullopt;
  };
  if (numbers.separation == 0) return verdict_of(first_root(f));

  const Linear s = length(numbers.separation);
  const auto s2 = s * s;
  if (!numbers.half_space.turns()) {
    const Polynomial<std::remove_cvref_t<decltype(f.c[0])>, 1> height{{f.c[0], f.c[1]}};
    auto excess = height * height;
    excess.c[0] = excess.c[0] - square.c[0] * s2;
    if (excess.c[0].sign() <= 0) return Verdict::at(0, ContactStatus::kHit);
    return verdict_of(first_root(excess));
  }
  if constexpr (Linear::kUnbounded) {
    for (auto& c : square.c) c = c * s2;
    const Polynomial<Big, 4> excess = f * f - square;
    if (excess.c[0].sign() <= 0) return Verdict::at(0, ContactStatus::kHit);
    return at_root(first_root(excess));
  }
  return {};
}

}  // namespace

Verdict exact_half_space_test(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                              double separation, std::uint64_t& exact_tests) {
  if (!is_finite(vertex, half_space, separation)) return Verdict::at(0, ContactStatus::kPossible);
  const Numbers numbers(vertex, half_space, separation);
  std::optional<Verdict> verdict;
  if (OfWidth<1>::fits(numbers)) {
    verdict = decide<OfWidth<1>>(numbers);
  } else if (OfWidth<2>::fits(numbers)) {
    verdict = decide<OfWidth<2>>(numbers);
  }
  if (!verdict) {
    ++exact_tests;
    verdict = decide<OfAnyWidth>(numbers);
  }
  return *verdict;
}

}  // namespace warmfront
