// SPDX-License-Identifier: Apache-2.0
// How near each other a pair may come where a commit of part of the motion rounds: the rules of max_step().
// Pure functions.
#pragma once

#include <algorithm>
#include <array>

#include "engine/elementary/start_gap.h"
#include "engine/elementary/verdict.h"
#include "engine/motion/commit_room.h"

namespace warmfront {

/// What a pair is tested for.
struct RoomQuestion {
  double separation = 0;            ///< that is asked for, with the thickness of both
  double room = 0;                  ///< CommitRoom::of() it
  double latest = 1;                ///< later contacts are not needed
  double tolerance = 0;             ///< see CertifiedOptions
  bool leave_out_overlaps = false;  ///< see ColliderOptions
};

/// What one elementary test is asked.
struct PairAsked {
  double separation = 0;
  double latest = 1;
  double tolerance = 0;
};

struct RoomVerdict {
  Verdict verdict;
  bool overlaps = false;  ///< it starts as near as counts, and no contact at the start tells so
};

/// Asks `test`, of a PairAsked a Verdict, until one tells how far the pair may go. With m the separation and
/// r the room, it stops
///   - at m + kAway r where it starts farther apart;
///   - else at m + kNear r where it starts farther apart than that: after a commit it is beyond m + r;
///   - else, as an overlap at t = 0, where it ever comes nearer than it starts by more than r, or its own
///   rounding, or within r: it may move apart, or along. Where overlaps are left out, it is counted, and
///   stops at the first of m and r, whichever is wider first, and 0 that it starts beyond, if any: so what
///   starts apart is not taken through.
/// How surely one that starts beyond is in contact is told by the test for m alone, where that finds any: by
/// its roundings the narrower test may know less surely of a start that is apart. `start`: its StartGap.
/// `comes_nearer`: the test of whether a pair comes within a separation at any time; no distance is kept by
/// it.
template <class Start, class Test, class ComesNearer>
RoomVerdict with_room(const RoomQuestion& asked, Start&& start, Test&& test, ComesNearer&& comes_nearer) {
  const auto overlaps = [](const Verdict& verdict) {
    return verdict.contact && verdict.status == ContactStatus::kOverlapAtStart;
  };
  const double m = asked.separation;
  const double r = asked.room;
  const auto plainly = [&](double separation) {
    return test(PairAsked{separation, asked.latest, asked.tolerance});
  };
  for (const double times : {CommitRoom::kAway, CommitRoom::kNear}) {
    Verdict verdict = plainly(m + times * r);
    if (overlaps(verdict)) {
      if (r == 0) break;
      continue;
    }
    if (!verdict.contact || r == 0) return {verdict};
    const Verdict surely = test(PairAsked{m, 1, asked.tolerance});
    if (surely.contact && !overlaps(surely)) verdict.status = surely.status;
    return {verdict};
  }
  const Verdict at_start{true, ContactStatus::kOverlapAtStart, 0};
  if (asked.leave_out_overlaps) {
    double within = r == 0 ? m : m + CommitRoom::kNear * r;
    for (const double separation : {std::max(m, r), std::min(m, r), 0.0}) {
      if (separation >= within) continue;
      const Verdict verdict = plainly(separation);
      if (!overlaps(verdict)) return {verdict, true};
      within = separation;
    }
    return {at_start};
  }
  const StartGap gap = start();
  const double slack = gap.slack(r);
  const double separation = std::max(r, gap.least - slack);
  const double within = std::max(0x1p-50, 0x1p-7 * (gap.least - separation) / gap.size);
  // At any time, whatever else was found before that.
  const Verdict nearer = comes_nearer(PairAsked{separation, 1, std::min(asked.tolerance, within)});
  return nearer.contact ? RoomVerdict{at_start} : RoomVerdict{nearer, true};
}

}  // namespace warmfront
