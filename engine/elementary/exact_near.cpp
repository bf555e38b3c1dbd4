// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact_near.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "engine/elementary/certified.h"
#include "engine/elementary/closest.h"
#include "engine/elementary/exact/common_divisor.h"
#include "engine/elementary/exact/isolated_roots.h"
#include "engine/elementary/near_polygon.h"

namespace warmfront {
namespace {

// Far finer than a tolerance that users ask for: in the window that is left, mostly one corner, side or
// interior can be at the separation, and its polynomial has one root.
constexpr double kFine = 0x1p-32;

// What doubles know of a pair that may come as near as the separation: not before `times.begin`, and, unless
// `times.end` is 1, certainly at `times.end`. So the first time, if there is one, is in this window.
class Narrowed {
 public:
  Narrowed(const Query& query, double begin) : query_(query), times{begin, 1} {
    for (int k = 45; k > 0; k -= 6) {
      const double t = begin + std::ldexp(1.0, -k);
      if (t >= 1) break;
      if (surely_near(query, t)) {
        times.end = t;
        break;
      }
    }
    motion_ = query.relative_motion * times.width() * (1 + 0x1p-40) + 0x1p-40;
    constexpr std::array<int, 4> kVertexFace{0, 1, 2, 0};
    constexpr std::array<int, 4> kEdgeEdge{0, 1, 3, 2};
    sides_ = query.kind == ContactKind::kVertexFace ? 3 : 4;
    for (int i = 0; i < sides_; ++i)
      p_[i] = query.gaps[sides_ == 3 ? kVertexFace[i] : kEdgeEdge[i]].at(begin);
    locate_interior();
  }

  // An upper bound of the distance at t, by points of the primitives, certainly below the separation.
  static bool surely_near(const Query& query, double t) {
    const double above = norm(closest_direction(query, t)) * (1 + 0x1p-50) + 0x1p-44;
    return above <= query.separation * (1 - 0x1p-48);
  }

  // May the distance of corner i, or that of side i, be the separation within the window, as the distance
  // between the primitives?
  bool corner(int i) const { return inside_ != Answer::kYes && !beyond(p_[i]); }
  bool side(int i) const {
    return inside_ != Answer::kYes && !beyond(closest_on_segment(p_[i], p_[(i + 1) % sides_]));
  }
  // Is the point of the polygon's plane that is nearest to the origin in the polygon throughout the window?
  // If so the distance is that of the plane.
  Answer interior() const { return inside_; }

  const Query& query_;
  Window times;

 private:
  bool beyond(const Vec3& nearest) const { return norm(nearest) > query_.separation + motion_; }

  // No C_i . N changes by more than 256 times the motion (README.md).
  void locate_interior() {
    if (motion_ > 1) return;
    const Vec3 n = cross(p_[1] - p_[0], p_[2] - p_[1]);
    bool all = true;
    for (int i = 0; i < sides_; ++i) {
      const double within = dot(cross(p_[i], p_[(i + 1) % sides_]), n);
      if (within < -256 * motion_) inside_ = Answer::kNo;
      all = all && within > 256 * motion_;
    }
    if (all) inside_ = Answer::kYes;
  }

  int sides_ = 0;
  double motion_ = 0;  // of any point relative to one of the other primitive, within the window; and rounding
  std::array<Vec3, 4> p_{};  // the polygon's corners at times.begin
  Answer inside_ = Answer::kUnknown;
};

// One root in [begin, end] of the narrowed window, or none, if that is certain from one sign at either end.
enum class Roots { kNone, kOne, kUnknown };

template <class Int, int kDegree>
Roots only_root(const Polynomial<Int, kDegree>& p, const Window& window, Root<Int>& root) {
  using Dyadic = typename Int::Dyadic;
  if (!Int::kUnbounded && window.begin != 0 && window.begin < 0x1p-73) return Roots::kUnknown;
  // With coefficients of at most 1, |p''| <= 70; the slope is within 2^-45 (README.md).
  const roots::Approximation<kDegree> approximation(p);
  if (!(std::fabs(approximation.slope(window.begin)) > 0x1p-44 + 71 * window.width())) return Roots::kUnknown;
  const auto begin = dyadic_of<Dyadic>(window.begin);
  const int before = evaluate(p, begin).sign();
  if (before == 0) {
    // At t = 0 there is no contact: that was looked at.
    if (window.begin == 0) return Roots::kNone;
    root = {begin, begin, window.begin, true};
    return Roots::kOne;
  }
  const auto end = dyadic_of<Dyadic>(window.end);
  if (evaluate(p, end).sign() == before) return Roots::kNone;
  const auto found = roots::locate(p, begin, end, before, nullptr);
  if (!found) return Roots::kUnknown;
  root = *found;
  return Roots::kOne;
}

// The sign of g at a root, from doubles, or at a root that is a double. Coefficients of at most 1 give g
// within 2^-48 and its change to the next double within 2^-49.
template <class Int, class Coefficient, int kDegree>
int certain_sign_at(const Root<Int>& root, const Polynomial<Coefficient, kDegree>& g) {
  if (root.exact) return evaluate(g, dyadic_of<typename Coefficient::Dyadic>(root.floor)).sign();
  if (g.is_zero()) return 0;
  const double value = roots::Approximation<kDegree>(g).at(root.floor);
  return value > 0x1p-46 ? 1 : value < -0x1p-46 ? -1 : kUnknownSign;
}

// No sign is negative, and one is positive.
template <class Signs>
Answer none_negative(const Signs& signs) {
  bool unknown = false;
  bool positive = false;
  for (const int sign : signs) {
    if (sign == -1) return Answer::kNo;
    unknown = unknown || sign == kUnknownSign;
    positive = positive || sign == 1;
  }
  if (unknown) return Answer::kUnknown;
  return positive ? Answer::kYes : Answer::kNo;
}

// The first time in the window, in integers of one width.
template <class Width>
class Decision {
 public:
  Decision(const NearPolygon<Width>& polygon, const Narrowed& narrowed)
      : polygon_(polygon), narrowed_(narrowed) {}

  // None: unknown, from Fixed only.
  std::optional<Verdict> find() {
    const int sides = polygon_.sides();
    for (int i = 0; i < sides; ++i) {
      if (narrowed_.corner(i) && !look(polygon_.corner(i), std::array<Quadratic, 0>{}, 0)) return {};
    }
    for (int i = 0; i < sides; ++i) {
      if (!narrowed_.side(i)) continue;
      const auto side = polygon_.side(i);
      if (!look(side.excess, side.within, 2)) return {};
    }
    if (narrowed_.interior() != Answer::kNo) {
      const bool surely = narrowed_.interior() == Answer::kYes;
      if (!look(polygon_.interior(), surely ? decltype(polygon_.within()){} : polygon_.within(),
                surely ? 0 : sides))
        return {};
    }
    return toi_ <= 1 ? Verdict::at(toi_, ContactStatus::kHit) : Verdict{};
  }

 private:
  using Quadratic = typename NearPolygon<Width>::Quadratic;

  // A corner, a side or the interior, whose distance counts while the first `count` polynomials of `within`
  // are such as none_negative(). With a count of 0 it always does. False if it stays unknown.
  template <class Int, int kDegree, class Within>
  bool look(const Polynomial<Int, kDegree>& excess, const Within& within, int count) {
    if (narrowed_.times.begin == 0 && excess.c[0].sign() <= 0) {
      if (at(within, count, [](const auto& g) { return g.c[0].sign(); }) == Answer::kYes) {
        toi_ = 0;
        return true;
      }
    }
    if (toi_ == 0 || excess.is_zero()) return true;
    Root<Int> root;
    const Roots roots = only_root(excess, narrowed_.times, root);
    if (roots == Roots::kNone) return true;
    if (roots == Roots::kOne) {
      if (root.floor >= toi_) return true;
      const Answer answer = at(within, count, [&](const auto& g) { return certain_sign_at(root, g); });
      if (answer == Answer::kYes) toi_ = root.floor;
      if (answer != Answer::kUnknown) return true;
    }
    if constexpr (Int::kUnbounded) {
      all_roots(excess, within, count);
      return true;
    }
    return false;
  }

  template <class Within, class Sign>
  static Answer at(const Within& within, int count, const Sign& sign) {
    if (count == 0) return Answer::kYes;
    std::array<int, 4> signs{};
    for (int i = 0; i < count; ++i) signs[i] = sign(within[i]);
    return none_negative(signs);
  }

  template <int kDegree, class Within>
  void all_roots(const Polynomial<Big, kDegree>& excess, const Within& within, int count) {
    const roots::Coefficients f = roots::squarefree(roots::coefficients(excess));
    const bool from_start = narrowed_.times.begin == 0;
    roots::isolate_roots(f, dyadic_of<BigDyadic>(narrowed_.times.begin),
                         dyadic_of<BigDyadic>(narrowed_.times.end), [&](const roots::IsolatedRoot& root) {
                           if (from_start && root.is_dyadic && root.begin.numerator.sign() == 0)
                             return true;  // seen above
                           const double floor = roots::floor_of_root(f, root);
                           if (floor >= toi_) return false;
                           const Answer answer = at(within, count, [&](const auto& g) {
                             return roots::sign_at_root(f, root, roots::coefficients(g));
                           });
                           if (answer == Answer::kYes) toi_ = floor;
                           return answer != Answer::kYes;
                         });
  }

  const NearPolygon<Width>& polygon_;
  const Narrowed& narrowed_;
  double toi_ = 2;
};

template <class Width>
std::optional<Verdict> in_integers(const FeatureVertices& features, double separation,
                                   const CoordinateBits& bits, const Narrowed& narrowed) {
  const NearPolygon<Width> polygon(features, separation, bits);
  return Decision<Width>(polygon, narrowed).find();
}

}  // namespace

Verdict exact_near_test(const FeatureVertices& features, double separation, double latest,
                        std::uint64_t& exact_tests) {
  const Query query = Query::prepare(features, separation);
  if (query.size == 0) return Verdict::at(0, ContactStatus::kHit);
  if (Narrowed::surely_near(query, 0)) return Verdict::at(0, ContactStatus::kHit);
  const Verdict certified =
      certified_test(features, {.tolerance = kFine, .min_separation = separation, .latest = latest});
  if (!certified.contact) return {};
  const Narrowed narrowed(query, certified.toi);
  const CoordinateBits bits(features, separation);
  std::optional<Verdict> verdict;
  if (NearWidth<1>::fits(bits)) {
    verdict = in_integers<NearWidth<1>>(features, separation, bits, narrowed);
  } else if (NearWidth<2>::fits(bits)) {
    verdict = in_integers<NearWidth<2>>(features, separation, bits, narrowed);
  }
  if (!verdict) {
    ++exact_tests;
    verdict = in_integers<AnyNearWidth>(features, separation, bits, narrowed);
  }
  return verdict->contact && verdict->toi <= latest ? *verdict : Verdict{};
}

}  // namespace warmfront
