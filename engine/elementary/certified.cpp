// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/certified.h"

#include <algorithm>
#include <array>
#include <optional>

#include "engine/elementary/closest.h"
#include "engine/elementary/cubic.h"
#include "engine/elementary/distance_below.h"
#include "engine/elementary/inside.h"

namespace warmfront {
namespace {

// Searches for the first window that cannot be excluded. Later windows wait on a stack; each bisection pushes
// one, and no window is halved below 2^-46, so the stack stays short.
class Search {
 public:
  Search(const Query& query, const CertifiedOptions& options)
      : query_(query), options_(options), cubic_(query), resolution_(options.tolerance * query.size / 2) {}

  Verdict run(Window window) {
    // Nearer than the separation from the start: bisection would only lead to t = 0.
    if (query_.separation > 0 && window.begin == 0 &&
        distance_above(0) <= query_.separation * (1 - 0x1p-48)) {
      return {true, ContactStatus::kOverlapAtStart, 0};
    }
    std::uint32_t looked_at = 0;
    for (;;) {
      if (window.begin > options_.latest) return {};
      if (++looked_at > options_.budget) return settle(window);
      const Window before = window;
      Step step = narrow(window);
      if (step == Step::kReport) {
        if (proved(window)) return Verdict::at(window.begin, ContactStatus::kHit);
        // One clip may turn a wide window into a fine one before the cubic was evaluated in it.
        Window rest = window;
        if (cubic_.clip(rest) && comes_near(window))
          return Verdict::at(window.begin, ContactStatus::kPossible);
        step = Step::kExcluded;
      }
      if (step == Step::kExcluded) {
        if (waiting_ == 0) return {};
        window = stack_[--waiting_];
      } else if (window.width() > 0.5 * before.width()) {
        const double middle = window.begin + 0.5 * window.width();
        stack_[waiting_++] = {middle, window.end};
        window.end = middle;
      }
    }
  }

 private:
  // Half of the rounding allowance of certified_reach(), for the least query size, 1/2.
  static constexpr double kClose = 0x1p-20;
  static constexpr int kSettlingLooks = 640;

  enum class Step { kExcluded, kReport, kNarrowed };

  // Trims from the window the times that are certainly free of contact.
  Step narrow(Window& window) const {
    const double before = window.width();
    if (!cubic_.clip(window)) return Step::kExcluded;
    const bool fine = is_fine(window);
    // The cubic is converging to a root: continue before running the more expensive tests.
    if (!fine && window.width() < 0.25 * before) return Step::kNarrowed;
    Inside where = Inside::kUnknown;
    if (query_.separation == 0) {
      where = inside(query_, window);
      if (where == Inside::kNo) return Step::kExcluded;
    }
    if (where != Inside::kYes && !trim_by_direction(window)) return Step::kExcluded;
    return fine ? Step::kReport : Step::kNarrowed;
  }

  // Separating directions from the closest points in the window's middle and, if much is left, at its begin
  // (conservative advancement).
  bool trim_by_direction(Window& window) const {
    const double before = window.width();
    const double middle = window.begin + 0.5 * before;
    if (!trim(window, separated_times(query_, normalised(closest_direction(query_, middle))))) return false;
    if (window.width() <= 0.5 * before || window.begin == 0) return true;
    return trim(window, separated_times(query_, normalised(closest_direction(query_, window.begin))));
  }

  // Within the window no relative motion exceeds half the tolerance, or the window is too short to halve.
  bool is_fine(const Window& window) const {
    return query_.relative_motion * window.width() <= resolution_ || window.width() <= 0x1p-46;
  }

  // Contact is proved by a certain sign change of the cubic while the inside tests certainly hold, over a
  // window slightly wider than the root's; with a separation, by closest points nearer than the separation.
  bool proved(const Window& window) const {
    if (query_.separation > 0) {
      const double after = std::min(1.0, window.end + window.width());
      return distance_above(window.begin) <= query_.separation * (1 - 0x1p-48) ||
             distance_above(after) <= query_.separation * (1 - 0x1p-48);
    }
    for (const double around : {0x1p-34, 0x1p-24, 0x1p-14}) {
      const Window wider{std::max(0.0, window.begin - around), std::min(1.0, window.end + around)};
      if (cubic_.certain_sign_change(wider)) return inside(query_, wider) == Inside::kYes;
    }
    return false;
  }

  // May the primitives come within the separation in a fine window? Directions from closest points are
  // inconclusive for thin or nearly parallel primitives, so such windows are reported only if the primitives
  // are also near at the window's begin; certified_reach() relies on this.
  [[gnu::noinline]] bool comes_near(const Window& window) const {
    const double within = barely_apart() + query_.relative_motion * window.width();
    return distance_above(window.begin) <= within + kClose || distance_below(query_, window.begin) <= within;
  }

  // The budget is spent. A remaining window of any width is free of contact if one direction separates all of
  // it; otherwise it is halved, unless the primitives are close where it begins. README.md, "What certified
  // reports", says for which pairs this always ends with no contact.
  [[gnu::noinline]] Verdict settle(Window window) {
    for (int looks = 0; looks < kSettlingLooks && window.begin <= options_.latest; ++looks) {
      if (distance_below(query_, window.begin) <= barely_apart() + kClose) break;
      if (distance_below(query_, window) > barely_apart()) {
        if (waiting_ == 0) return {};
        window = stack_[--waiting_];
      } else if (waiting_ < static_cast<int>(stack_.size())) {
        const double middle = window.begin + 0.5 * window.width();
        stack_[waiting_++] = {middle, window.end};
        window.end = middle;
      } else {
        break;
      }
    }
    if (window.begin > options_.latest) return {};
    return Verdict::at(window.begin, ContactStatus::kBudget);
  }

  // Distances above this certainly exceed the separation: the margin exceeds all rounding in the comparison.
  double barely_apart() const { return query_.separation * (1 + 0x1p-40) + 0x1p-40; }

  double distance_above(double t) const { return warmfront::distance_above(closest_direction(query_, t)); }

  const Query& query_;
  const CertifiedOptions& options_;
  Cubic cubic_;
  double resolution_;
  std::array<Window, 64> stack_;
  int waiting_ = 0;
};

}  // namespace

Verdict certified_test(const FeatureVertices& features, const CertifiedOptions& options) {
  const Query query = Query::prepare(features, options.min_separation);
  if (query.size == 0) return {true, ContactStatus::kOverlapAtStart, 0};
  Window window;
  if (!trim_by_kdop(query, window)) return {};
  return certified_search(query, options, window);
}

Verdict certified_search(const Query& query, const CertifiedOptions& options, const Window& window) {
  return Search(query, options).run(window);
}

}  // namespace warmfront
