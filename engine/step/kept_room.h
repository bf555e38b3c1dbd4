// SPDX-License-Identifier: Apache-2.0
// How far apart the boxes of two things must be in a piece of a motion, where each pair of features has a
// separation of its own that follows from how far apart it starts. Pure values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/elementary/keep_distance.h"
#include "engine/step/chord_boxes.h"

namespace warmfront {

/// No point of one box is farther from any point of the other; rounded up by more than squares lose that are
/// too small, and no less for what holds them. Infinite for what is not a number.
inline double farthest_apart(const ChordBox& a, const ChordBox& b) {
  std::array<double, 3> way{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double up = b.high[k] - a.low[k];
    const double down = a.high[k] - b.low[k];
    if (std::isnan(up) || std::isnan(down)) return std::numeric_limits<double>::infinity();
    way[k] = std::max(up, down);
  }
  return std::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]) * (1 + 0x1p-40) + kTooSmall;
}

/// Of two parts. A pair of their features that starts d apart is in contact within m + s (d - m), which grows
/// with d and with m, and d is no more than boxes around both at the start are apart at most. So boxes that
/// are farther apart than the room of that separation leave out nothing that is reported, as they do for a
/// separation that all share. Boxes in which lie those of more have no less room: where anything below two
/// nodes is near, so are they.
class KeptRoom {
 public:
  KeptRoom() = default;
  /// `widest`: at least every pair's separation; `besides` it is what the test allows itself, and
  /// `share_of_separation` more. `keep.beyond`: at least every pair's m.
  KeptRoom(const KeepDistance& keep, double widest, double besides, double share_of_separation)
      : keep_(keep), besides_(besides), share_(share_of_separation), most_(room_of(widest)) {}

  /// For all.
  double most() const { return most_; }
  /// Does each pair have its own?
  bool differs() const { return keep_.share > 0; }
  /// For what lies in these boxes at the start.
  double of(const ChordBox& a, const ChordBox& b) const { return of_distance(farthest_apart(a, b)); }
  /// For two primitives whose corners these are then.
  double of(const Corners& f, const Corners& g) const { return of_distance(farthest_features(f, g)); }

 private:
  double of_distance(double far) const {
    const double room = room_of(keep_.of_distance(far));
    return room < most_ ? room : most_;
  }
  double room_of(double separation) const { return separation + besides_ + share_ * separation; }

  KeepDistance keep_;
  double besides_ = 0;
  double share_ = 0;
  double most_ = 0;
};

}  // namespace warmfront
