// SPDX-License-Identifier: Apache-2.0
// How near each other a pair may come where a commit of part of the motion rounds: the rules of max_step().
// Pure functions.
#pragma once

#include <algorithm>
#include <optional>

#include "engine/elementary/start_gap.h"
#include "engine/elementary/verdict.h"
#include "engine/motion/commit_room.h"

namespace warmfront {

/// What a pair is tested for.
struct RoomQuestion {
  double separation = 0;            ///< that is asked for, with the thickness of both
  double room = 0;                  ///< CommitRoom::of() it
  double latest = 1;                ///< later contacts are not needed
  bool leave_out_overlaps = false;  ///< see ColliderOptions
};

/// What one elementary test is asked.
struct PairAsked {
  double separation = 0;
  double latest = 1;
};

struct RoomVerdict {
  Verdict verdict;
  bool overlaps = false;  ///< it starts as near as counts, and no contact at the start tells so
};

/// The rules. With m the separation and r the room, a pair stops
///   - at m + kAway r where it starts farther apart;
///   - else at m + kNear r where it starts farther apart than that: after a commit it is beyond m + r;
///   - else, it starts near: not at all where it comes no nearer (start_gap.h): it may move apart, or along.
///   What comes nearer stops at t = 0. Beyond m + r it may come r nearer, but not within m + r, which the
///   roundings of a motion along may do.
/// Where overlaps are left out, what starts near is asked so once more without the separation, and what
/// touches at the start does not stop at all. What does not move, or is kept on its side by any rounding,
/// does not come nearer; else what starts within r does, where it is not left out, since a commit of whatever
/// part of its motion might take it through.
///
/// How surely one that starts beyond is in contact is told by the test for m alone, where that finds any: by
/// its roundings the narrower test may know less surely of a start that is apart.
///
/// `Pair`: of one pair, test(PairAsked), a Verdict; start(), its StartGap; rests(); keeps_its_side(), also
/// that of a half-space that it is in, whatever part of its motion a commit rounds; starts_within(separation)
/// and comes_within(separation), at any time.
template <class Pair>
class WithRoom {
 public:
  WithRoom(const RoomQuestion& asked, Pair& pair) : asked_(asked), pair_(pair) {}

  RoomVerdict verdict() {
    if (pair_.rests()) {
      const bool near = pair_.test({asked_.separation, 1}).contact;
      return {{}, near};
    }
    if (const auto stopped = beyond(asked_.separation)) return {*stopped};
    if (!asked_.leave_out_overlaps && near(asked_.separation))
      return {{true, ContactStatus::kOverlapAtStart, 0}};
    // A test that resolves less may take for near what is not, and keeps its separation.
    const bool starts_near = pair_.starts_within(asked_.separation + CommitRoom::kNear * asked_.room);
    if (!asked_.leave_out_overlaps) return {{}, starts_near};
    if (!starts_near) return {near(asked_.separation) ? Verdict{true, ContactStatus::kHit, 0} : Verdict{}};
    if (asked_.separation > 0) {
      if (const auto stopped = beyond(0)) return {*stopped, true};
    }
    return {near(0) ? Verdict{true, ContactStatus::kHit, 0} : Verdict{}, true};
  }

 private:
  static bool overlaps(const Verdict& verdict) {
    return verdict.contact && verdict.status == ContactStatus::kOverlapAtStart;
  }

  // Where it stops with a separation of m; none where it starts near.
  std::optional<Verdict> beyond(double m) {
    for (const double times : {CommitRoom::kAway, CommitRoom::kNear}) {
      Verdict verdict = pair_.test({m + times * asked_.room, asked_.latest});
      if (overlaps(verdict)) continue;
      if (!verdict.contact) return verdict;
      const Verdict surely = pair_.test({m, 1});
      if (surely.contact && !overlaps(surely)) verdict.status = surely.status;
      return verdict;
    }
    return std::nullopt;
  }

  // Does one that starts near come nearer, at any time, whatever was found before that?
  bool near(double m) {
    const double r = asked_.room;
    const StartGap gap = pair_.start();
    const double slack = gap.slack();
    const double as_it_starts = gap.least - slack;
    double within = as_it_starts;
    if (slack > r)
      within = gap.least > m ? std::max(within, m) : within;
    else if (gap.least > m + r + slack)
      within = std::max(gap.least - r, m + r);
    if (within >= r) return pair_.comes_within(within);
    if (!pair_.starts_within(r)) return pair_.comes_within(r);  // doubles did not find how far it is
    if (pair_.keeps_its_side()) return false;
    if (!asked_.leave_out_overlaps) return true;
    return !pair_.starts_within(0) && pair_.comes_within(std::max(0.0, as_it_starts));
  }

  const RoomQuestion& asked_;
  Pair& pair_;
};

}  // namespace warmfront
