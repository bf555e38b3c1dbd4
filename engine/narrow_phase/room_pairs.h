// SPDX-License-Identifier: Apache-2.0
// The kinds of pairs that WithRoom asks: what moves along lines, along arcs, and vertices and half-spaces.
// Each by an elementary test of the question's tier, `test`, and by tests that do not depend on the tier.
// Used by one thread at a time.
#pragma once

#include "engine/elementary/start_gap.h"
#include "engine/elementary/turning.h"
#include "engine/narrow_phase/with_room.h"

namespace warmfront {

/// What no rule needs to know of its kind. `rests`: nothing of it moves. `by_itself` and `straight`: see
/// CommitRoom::by_themselves() and leave_straight().
struct RoomPairState {
  bool rests = false;
  bool by_itself = false;
  bool straight = false;
  double most = 0;  ///< what its least distance need not be above
  ElementaryCounts& counts;
};

template <class Test>
class LinesInRoom {
 public:
  LinesInRoom(const FeatureVertices& features, const RoomPairState& state, Test& test)
      : features_(features), state_(state), test_(test) {}

  Verdict test(const PairAsked& asked) { return test_(asked); }
  StartGap start() const { return start_gap(features_, state_.most); }
  bool rests() const { return state_.rests; }
  bool starts_within(double separation) {
    return warmfront::starts_within(features_, separation, state_.counts);
  }
  bool keeps_its_side() const {
    return (state_.straight && parts_by_axis(features_)) ||
           (state_.by_itself && warmfront::keeps_its_side(features_));
  }
  bool comes_within(double separation) {
    return warmfront::comes_within(features_, separation, state_.counts);
  }

 private:
  const FeatureVertices& features_;
  RoomPairState state_;
  Test& test_;
};

template <class Test>
class ArcsInRoom {
 public:
  ArcsInRoom(const TurningPair& pair, const RoomPairState& state, Test& test)
      : pair_(pair), state_(state), test_(test) {}

  Verdict test(const PairAsked& asked) { return test_(asked); }
  StartGap start() const {
    StartGap gap = start_gap(pair_.features, state_.most);
    gap.arcs = turning_slack(pair_);
    return gap;
  }
  bool rests() const { return state_.rests; }
  bool starts_within(double separation) {
    return warmfront::starts_within(pair_.features, separation, state_.counts);
  }
  bool keeps_its_side() const { return false; }
  bool comes_within(double separation) const { return turning_comes_within(pair_, separation); }

 private:
  const TurningPair& pair_;
  RoomPairState state_;
  Test& test_;
};

template <class Test>
class HalfSpaceInRoom {
 public:
  HalfSpaceInRoom(const VertexMotion& vertex, const Twist* twist, const HalfSpaceMotion& half_space,
                  const RoomPairState& state, Test& test)
      : vertex_(vertex), twist_(twist), half_space_(half_space), state_(state), test_(test) {}

  Verdict test(const PairAsked& asked) { return test_(asked); }
  StartGap start() const {
    StartGap gap = start_gap(vertex_, half_space_);
    if (twist_ != nullptr) gap.arcs = turning_half_space_slack(vertex_, *twist_, half_space_);
    return gap;
  }
  bool rests() const { return state_.rests; }
  bool starts_within(double separation) {
    return warmfront::starts_within(vertex_, half_space_, separation, state_.counts);
  }
  bool keeps_its_side() const {
    if (twist_ != nullptr) return false;
    return (state_.straight && goes_with_normal(vertex_, half_space_)) ||
           (state_.by_itself && warmfront::keeps_its_side(vertex_, half_space_)) ||
           is_inside_and_goes_no_deeper(vertex_, half_space_);
  }
  bool comes_within(double separation) {
    if (twist_ == nullptr) return warmfront::comes_within(vertex_, half_space_, separation, state_.counts);
    return turning_half_space_comes_within(vertex_, *twist_, half_space_, separation, state_.counts);
  }

 private:
  const VertexMotion& vertex_;
  const Twist* twist_;
  const HalfSpaceMotion& half_space_;
  RoomPairState state_;
  Test& test_;
};

}  // namespace warmfront
