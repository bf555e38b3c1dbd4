// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact.h"

#include <algorithm>
#include <array>
#include <optional>

#include "engine/elementary/cubic.h"
#include "engine/elementary/exact_polygon.h"
#include "engine/elementary/inside.h"

namespace warmfront {
namespace {

// What double arithmetic can say: kYes with a window before whose begin there is no contact, and in which the
// first root of the cubic from there on is one.
class CertainAnswer {
 public:
  explicit CertainAnswer(const Query& query) : query_(query), cubic_(query) {}

  Answer find(Window& window, double latest) {
    for (int looked_at = 0; looked_at < 24; ++looked_at) {
      if (window.begin > latest) return Answer::kNo;
      const double before = window.width();
      const Answer answer = decide(window);
      if (answer == Answer::kYes) return answer;
      if (answer == Answer::kNo) {
        if (waiting_ == 0) return answer;
        window = stack_[--waiting_];
      } else if (window.width() <= 0x1p-44) {
        return answer;
      } else if (window.width() > 0.5 * before) {
        const double middle = window.begin + 0.5 * window.width();
        stack_[waiting_++] = {middle, window.end};
        window.end = middle;
      }
    }
    return Answer::kUnknown;
  }

 private:
  Answer decide(Window& window) const {
    // Clipping takes off only what holds no root, so a sign change before is one after.
    const bool has_root = cubic_.certain_sign_change(window);
    double before = 0;
    do {
      before = window.width();
      if (!cubic_.clip(window)) return Answer::kNo;
    } while (window.width() < 0.25 * before);
    switch (inside(query_, window)) {
      case Inside::kNo:
        return Answer::kNo;
      case Inside::kYes:
        return has_root ? Answer::kYes : Answer::kUnknown;
      case Inside::kUnknown:
        return Answer::kUnknown;
    }
    return Answer::kUnknown;
  }

  const Query& query_;
  Cubic cubic_;
  std::array<Window, 24> stack_;
  int waiting_ = 0;
};

using MaybeVerdict = std::optional<Verdict>;

// The time of the first root of f that is in `window`.
template <class Width>
MaybeVerdict first_root(const DifferencePolygon<Width>& polygon, const Window& window) {
  auto f = polygon.volume();
  if (window.begin == 0 && f.c[0].sign() == 0) return Verdict::at(0, ContactStatus::kHit);
  double toi = 2;
  const Answer answer = visit_roots(std::move(f), &window, [&](const auto&, const auto& root) {
    // Roots before the window are no contacts; at its begin, a double, the floor is not before it.
    if (root.floor < window.begin) return Answer::kNo;
    toi = root.floor;
    return Answer::kYes;
  });
  if (answer == Answer::kUnknown) return {};
  return Verdict::at(toi, ContactStatus::kHit);
}

// The origin stays in the polygon's plane. It is in the polygon from the start (which has been excluded), or
// from a time on when it comes to lie on a side: before the first such time it is outside, and if it were
// strictly inside then, it would have been so before. A side i holds it when C_i = 0 and P_i . P_i+1 <= 0:
// the first time is a root of any component of C_i that is not zero for good, or, when C_i is, of P_i .
// P_i+1, positive at first.
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
    const Answer answer = visit_roots(std::move(q), nullptr, [&](const auto& f, const auto& root) {
      if (root.floor >= toi) return Answer::kYes;
      const Answer on = polygon.on_side(i, [&](const auto& g) { return sign_at(f, root, g); });
      if (on == Answer::kYes) toi = root.floor;
      return on;
    });
    if (answer == Answer::kUnknown) return {};
  }
  return toi <= 1 ? Verdict::at(toi, ContactStatus::kHit) : Verdict{};
}

// The whole question in integers.
template <class Width>
MaybeVerdict decide(const DifferencePolygon<Width>& polygon) {
  auto f = polygon.volume();
  if (f.c[0].sign() == 0 &&
      polygon.holds_origin([](const auto& g) { return g.c[0].sign(); }) == Answer::kYes) {
    return Verdict::at(0, ContactStatus::kHit);
  }
  if (f.is_zero()) return coplanar(polygon);
  double toi = 2;
  const Answer answer = visit_roots(std::move(f), nullptr, [&](const auto& factor, const auto& root) {
    const Answer inside = polygon.holds_origin([&](const auto& g) { return sign_at(factor, root, g); });
    if (inside == Answer::kYes) toi = root.floor;
    return inside;
  });
  if (answer == Answer::kUnknown) return {};
  return answer == Answer::kYes ? Verdict::at(toi, ContactStatus::kHit) : Verdict{};
}

template <class Width>
MaybeVerdict in_integers(const FeatureVertices& features, const CoordinateBits& bits, const Window* window) {
  const DifferencePolygon<Width> polygon(features, bits);
  return window != nullptr ? first_root(polygon, *window) : decide(polygon);
}

// `window`: where the first contact is known to be the first root; null if nothing is known.
Verdict in_integers(const FeatureVertices& features, const Window* window, std::uint64_t& exact_tests) {
  const CoordinateBits bits(features);
  MaybeVerdict verdict;
  if (FixedWidth<1>::fits(bits)) {
    verdict = in_integers<FixedWidth<1>>(features, bits, window);
  } else if (FixedWidth<2>::fits(bits)) {
    verdict = in_integers<FixedWidth<2>>(features, bits, window);
  }
  if (!verdict) {
    ++exact_tests;
    verdict = in_integers<AnyWidth>(features, bits, window);
  }
  return *verdict;
}

}  // namespace

CoordinateBits::CoordinateBits(const FeatureVertices& features) : lowest{}, span(0) {
  for (int axis = 0; axis < 3; ++axis) {
    int least = 2048;
    int greatest = -2048;
    for (const VertexMotion* vertex : features.vertex) {
      for (const double x : {vertex->t0[axis], vertex->t1[axis]}) {
        const auto bits = std::bit_cast<std::uint64_t>(x) << 1;
        if (bits == 0) continue;
        const auto exponent = static_cast<int>(bits >> 53);
        const int zeros = std::min(52, std::countr_zero(bits) - 1);
        least = std::min(least, std::max(exponent, 1) - 1075 + zeros);
        greatest = std::max(greatest, std::max(exponent, 1) - 1022);
      }
    }
    if (greatest < least) continue;
    lowest[axis] = least;
    span = std::max(span, greatest - least);
  }
}

Verdict exact_test(const FeatureVertices& features, double latest, std::uint64_t& exact_tests) {
  const Query query = Query::prepare(features, 0);
  if (query.size == 0) return Verdict::at(0, ContactStatus::kHit);
  Window window;
  if (!trim_by_kdop(query, window)) return {};
  const Answer answer = CertainAnswer(query).find(window, latest);
  if (answer == Answer::kNo) return {};
  const Verdict verdict = in_integers(features, answer == Answer::kYes ? &window : nullptr, exact_tests);
  return verdict.contact && verdict.toi <= latest ? verdict : Verdict{};
}

}  // namespace warmfront
