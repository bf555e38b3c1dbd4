// SPDX-License-Identifier: Apache-2.0
// What max_step() says of one pair. A pure function.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "engine/elementary/elementary_test.h"
#include "engine/elementary/keep_distance.h"
#include "engine/elementary/start_gap.h"
#include "engine/question.h"
#include "tests/support/commit_room_oracle.h"

namespace warmfront::testing {

/// A pair of which every vertex is rounded by itself, or not, so that it is `rounding` nearer at most.
inline RoomOracle lines_in_room(const FeatureVertices& features, double rounding, bool by_itself,
                                double asked, std::function<Verdict(double)> test) {
  static thread_local ElementaryCounts counts;
  RoomOracle pair;
  pair.size = pair_size(features);
  pair.rounding = rounding;
  const double room = std::max(rounding, std::ldexp(std::max(pair.size, asked), -44));
  pair.start = start_gap(features, asked + 2 * room);
  pair.keeps_its_side = by_itself && keeps_its_side(features);
  pair.test = std::move(test);
  pair.starts_within = [features](double within) { return starts_within(features, within, counts); };
  pair.comes_within = [features](double within) { return comes_within(features, within, counts); };
  return pair;
}

/// Of a pair that moves along lines, asked with a tier in a session of float64 with these
/// options; `thickness`: of both features together.
inline Verdict max_step_verdict(const FeatureVertices& features, const QuestionOptions& question,
                                bool leave_out_overlaps, const ColliderOptions& of_session,
                                double thickness) {
  const double tolerance =
      question.keep_distance && question.tier == Tier::kExact ? 0x1p-32 : of_session.tolerance;
  ElementaryCounts counts;
  const auto test = [&](double separation) {
    return question.keep_distance
               ? keep_distance_test(features, {*question.keep_distance, separation}, {.tolerance = tolerance})
               : elementary_test(
                     features, {.tier = *question.tier, .tolerance = tolerance, .min_separation = separation},
                     counts);
  };
  const double asked = of_session.min_separation + thickness;
  return with_room(asked, leave_out_overlaps,
                   lines_in_room(features, room_of(features, Rounding::kFloat64), true, asked, test));
}

}  // namespace warmfront::testing
