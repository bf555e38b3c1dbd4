// SPDX-License-Identifier: Apache-2.0
// What max_step() says of one pair. A pure function.
#pragma once

#include "engine/elementary/elementary_test.h"
#include "engine/elementary/keep_distance.h"
#include "engine/question.h"
#include "tests/support/commit_room_oracle.h"

namespace warmfront::testing {

/// Of a pair of this kind that moves along lines, asked with a tier in a session of float64 with these
/// options; `thickness`: of both features together.
inline Verdict max_step_verdict(ContactKind kind, const FeatureVertices& features,
                                const QuestionOptions& question, bool leave_out_overlaps,
                                const ColliderOptions& of_session, double thickness) {
  const CertifiedOptions certified{.tolerance =
                                       question.tier == Tier::kExact ? 0x1p-32 : of_session.tolerance};
  ElementaryCounts counts;
  const auto test = [&](double separation) {
    return question.keep_distance
               ? keep_distance_test(features, {*question.keep_distance, separation}, certified)
               : elementary_test(features,
                                 {.tier = *question.tier,
                                  .tolerance = of_session.tolerance,
                                  .min_separation = separation},
                                 counts);
  };
  return with_room(of_session.min_separation + thickness, room_of(kind, features, Rounding::kFloat64),
                   leave_out_overlaps, test);
}

}  // namespace warmfront::testing
