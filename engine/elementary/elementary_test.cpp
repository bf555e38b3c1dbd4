// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/elementary_test.h"

#include "engine/elementary/certified.h"
#include "engine/elementary/exact.h"
#include "engine/elementary/exact_near.h"
#include "engine/elementary/fast.h"

namespace warmfront {

Verdict elementary_test(const FeatureVertices& features, const ElementaryOptions& options,
                        ElementaryCounts& counts) {
  if (options.tier == Tier::kFast) return fast_test(features, options.latest);
  if (options.tier == Tier::kExact && options.min_separation > 0)
    return exact_near_test(features, options.min_separation, options.latest, counts.exact_tests);
  if (options.tier == Tier::kExact) return exact_test(features, options.latest, counts.exact_tests);
  return certified_test(features, {.tolerance = options.tolerance,
                                   .min_separation = options.min_separation,
                                   .budget = options.budget,
                                   .latest = options.latest});
}

}  // namespace warmfront
