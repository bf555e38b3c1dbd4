// SPDX-License-Identifier: Apache-2.0
// What max_step() says of one pair. A pure function.
#pragma once

#include "engine/elementary/elementary_test.h"
#include "engine/elementary/keep_distance.h"
#include "engine/question.h"
#include "tests/support/commit_room_oracle.h"

namespace warmfront::testing {

/// By the direction between the closest points at the start, or by the tier's test.
inline Verdict comes_within(const FeatureVertices& features, Tier tier, double separation, double tolerance) {
  ElementaryCounts counts;
  if (stays_apart(features, separation)) return {};
  return elementary_test(features, {.tier = tier, .tolerance = tolerance, .min_separation = separation},
                         counts);
}

/// Of a pair that moves along lines, asked with a tier in a session of float64 with these
/// options; `thickness`: of both features together.
inline Verdict max_step_verdict(const FeatureVertices& features, const QuestionOptions& question,
                                bool leave_out_overlaps, const ColliderOptions& of_session,
                                double thickness) {
  const double tolerance =
      question.keep_distance && question.tier == Tier::kExact ? 0x1p-32 : of_session.tolerance;
  ElementaryCounts counts;
  const auto test = [&](double separation, double within) {
    return question.keep_distance
               ? keep_distance_test(features, {*question.keep_distance, separation}, {.tolerance = within})
               : elementary_test(features,
                                 {.tier = *question.tier, .tolerance = within, .min_separation = separation},
                                 counts);
  };
  const double asked = of_session.min_separation + thickness;
  const double room = room_of(features, Rounding::kFloat64);
  const auto comes_nearer = [&](double separation, double within) {
    return comes_within(features, *question.tier, separation, within);
  };
  return with_room(asked, room, leave_out_overlaps, start_gap(features, asked + 2 * room), tolerance, test,
                   comes_nearer);
}

}  // namespace warmfront::testing
