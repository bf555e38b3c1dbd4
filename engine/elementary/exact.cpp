// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact.h"

#include <algorithm>
#include <array>
#include <optional>
#include <type_traits>

#include "engine/elementary/closest.h"
#include "engine/elementary/cubic.h"
#include "engine/elementary/exact_polygon.h"
#include "engine/elementary/float_roots.h"
#include "engine/elementary/inside.h"

namespace warmfront {
namespace {

// What double arithmetic can decide with certainty. kYes: a root of the cubic is the first contact, and the
// only root in `window`, before which the cubic has the sign `sign_before`.
class CertainAnswer {
 public:
  explicit CertainAnswer(const Query& query) : query_(query), cubic_(query), powers_(cubic_.coefficient) {}

  Answer find(double latest) {
    if (const Answer answer = piece({0, 1}, cubic_.coefficient); answer != Answer::kUnknown) return answer;
    if (near_a_root_) return Answer::kUnknown;
    // Between its critical points a cubic has at most one root.
    const Turns turns(powers_);
    for (int i = 1; i < turns.count; ++i) {
      const Window between{turns.time[i - 1], turns.time[i]};
      if (between.begin > latest) return Answer::kNo;
      if (const Answer answer = piece(between, cubic_.on(between)); answer != Answer::kNo) return answer;
    }
    return Answer::kNo;
  }

  Window window;
  int sign_before = 0;

 private:
  // One interval of the step, with the cubic's coefficients on it: no, one or an unknown number of roots by
  // Descartes' rule; if one, whether it is a contact.
  Answer piece(const Window& whole, const std::array<double, 4>& k) {
    const double certain = cubic_.certain();
    std::array<int, 4> sign;
    for (int i = 0; i < 4; ++i) sign[i] = (k[i] > certain) - (k[i] < -certain);
    if (sign[0] == 0 || sign[3] == 0) return Answer::kUnknown;
    if (sign[0] == sign[3]) return sign[1] == sign[0] && sign[2] == sign[0] ? Answer::kNo : Answer::kUnknown;
    // At most one sign change from sign[0] to sign[3], whatever an uncertain sign in between is.
    if (sign[1] != sign[0] && sign[2] != sign[3]) return Answer::kUnknown;
    sign_before = sign[0];
    return root(whole, k[0]);
  }

  Answer root(const Window& whole, double at_begin) {
    const double t = root_between(powers_, whole.begin, whole.end, at_begin);
    double around = 4 * cubic_.certain() / std::fabs(powers_.slope(t)) + 0x1p-50;
    near_a_root_ = true;
    for (int widening = 0; widening < 3; ++widening, around *= 256) {
      window = {std::max(whole.begin, t - around), std::min(whole.end, t + around)};
      if (!cubic_.certain_sign_change(window)) continue;
      Inside where = inside_around(query_, t, around);
      if (where == Inside::kUnknown) where = inside(query_, window);
      switch (where) {
        case Inside::kNo:
          return Answer::kNo;
        case Inside::kYes:
          return Answer::kYes;
        case Inside::kUnknown:
          return apart() ? Answer::kNo : Answer::kUnknown;
      }
    }
    return Answer::kUnknown;
  }

  // Where the primitives are parallel or degenerate at the root, inside tests are inconclusive; try
  // directions.
  bool apart() const {
    const Vec3 direction = normalised(closest_direction(query_, window.begin + 0.5 * window.width()));
    Window left = window;
    return !trim(left, separated_times(query_, direction));
  }

  const Query& query_;
  Cubic cubic_;
  PowerCubic powers_;
  bool near_a_root_ = false;  // the roots are located, but an inside test at one is inconclusive
};

using MaybeVerdict = std::optional<Verdict>;

// The time of f's only root in `window`, at whose begin the cubic has the sign `sign_before`: det(P_0, P_1,
// P_2), but for edges det(b - a, c - a, d - a), which is its opposite.
template <class Width>
MaybeVerdict only_root(const DifferencePolygon<Width>& polygon, const Window& window, int sign_before) {
  using Dyadic = typename Width::Linear::Dyadic;
  if (!Width::Linear::kUnbounded && window.begin < 0x1p-73) return {};
  const auto f = polygon.volume();
  const double guess = window.begin + 0.5 * window.width();
  if constexpr (std::is_same_v<Width, NarrowWidth>) {
    const auto floor = roots::floor_in_fixed_point(f, guess);
    if (floor && *floor >= window.begin && *floor < window.end)
      return Verdict::at(*floor, ContactStatus::kHit);
  }
  const auto root = roots::locate(f, dyadic_of<Dyadic>(window.begin), dyadic_of<Dyadic>(window.end),
                                  polygon.sides() == 3 ? sign_before : -sign_before, &guess);
  if (!root) return {};
  return Verdict::at(root->floor, ContactStatus::kHit);
}

// The origin stays in the polygon's plane. It is in the polygon from the start (excluded before), or from the
// time at which it first lies on a side: before that time it is outside, and if it were strictly inside at
// that time, it would have been so before. Side i contains it when C_i = 0 and P_i . P_i+1 <= 0: the first
// time is a root of any component of C_i that is not identically zero, or, if C_i is, of P_i . P_i+1,
// positive at first.
template <class Width>
MaybeVerdict coplanar(const DifferencePolygon<Width>& polygon) {
  double toi = 2;
  for (int i = 0; i < polygon.sides(); ++i) {
    auto q = polygon.along(i);
    for (int axis = 0; axis < 3; ++axis) {
      if (auto turn = polygon.turn(i, axis); !turn.is_zero()) {
        q = std::move(turn);
        break;
      }
    }
    if (q.is_zero()) continue;
    const Answer answer = visit_roots(std::move(q), [&](const auto& f, const auto& root) {
      if (root.floor >= toi) return Answer::kYes;
      const Answer on = polygon.on_side(i, [&](const auto& g) { return sign_at(f, root, g); });
      if (on == Answer::kYes) toi = root.floor;
      return on;
    });
    if (answer == Answer::kUnknown) return {};
  }
  return toi <= 1 ? Verdict::at(toi, ContactStatus::kHit) : Verdict{};
}

// The whole test in integers.
template <class Width>
MaybeVerdict decide(const DifferencePolygon<Width>& polygon) {
  auto f = polygon.volume();
  if (f.c[0].sign() == 0 &&
      polygon.holds_origin([](const auto& g) { return g.c[0].sign(); }) == Answer::kYes) {
    return Verdict::at(0, ContactStatus::kHit);
  }
  if (f.is_zero()) return coplanar(polygon);
  double toi = 2;
  const Answer answer = visit_roots(std::move(f), [&](const auto& factor, const auto& root) {
    const Answer inside = polygon.holds_origin([&](const auto& g) { return sign_at(factor, root, g); });
    if (inside == Answer::kYes) toi = root.floor;
    return inside;
  });
  if (answer == Answer::kUnknown) return {};
  return answer == Answer::kYes ? Verdict::at(toi, ContactStatus::kHit) : Verdict{};
}

template <class Width>
MaybeVerdict in_integers(const FeatureVertices& features, const CoordinateBits& bits,
                         const CertainAnswer* certain) {
  const DifferencePolygon<Width> polygon(features, bits);
  return certain != nullptr ? only_root(polygon, certain->window, certain->sign_before) : decide(polygon);
}

// `certain`: an answer kYes; null if double arithmetic decided nothing.
Verdict in_integers(const FeatureVertices& features, const CertainAnswer* certain,
                    std::uint64_t& exact_tests) {
  const CoordinateBits bits(features);
  MaybeVerdict verdict;
  if (NarrowWidth::fits(bits)) {
    verdict = in_integers<NarrowWidth>(features, bits, certain);
  } else if (FixedWidth<1>::fits(bits)) {
    verdict = in_integers<FixedWidth<1>>(features, bits, certain);
  } else if (FixedWidth<2>::fits(bits)) {
    verdict = in_integers<FixedWidth<2>>(features, bits, certain);
  }
  if (!verdict) {
    ++exact_tests;
    verdict = in_integers<AnyWidth>(features, bits, certain);
  }
  return *verdict;
}

}  // namespace

Verdict exact_test(const FeatureVertices& features, double latest, std::uint64_t& exact_tests) {
  const Query query = Query::prepare(features, 0);
  if (query.size == 0) return Verdict::at(0, ContactStatus::kHit);
  CertainAnswer certain(query);
  const Answer answer = certain.find(latest);
  if (answer == Answer::kNo) return {};
  if (answer == Answer::kUnknown) {
    Window window;
    if (!trim_by_kdop(query, window)) return {};
  }
  const Verdict verdict = in_integers(features, answer == Answer::kYes ? &certain : nullptr, exact_tests);
  return verdict.contact && verdict.toi <= latest ? verdict : Verdict{};
}

}  // namespace warmfront
