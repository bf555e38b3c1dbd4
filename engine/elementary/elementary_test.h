// SPDX-License-Identifier: Apache-2.0
// The entry point of the elementary tests: runs a feature pair through the cascade of a tier. A pure function
// except for the counts, safe to call from any thread in the default floating-point environment (Workers
// checks it).
#pragma once

#include <cstdint>

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"
#include "engine/options.h"

namespace warmfront {

struct ElementaryOptions {
  Tier tier = Tier::kCertified;
  double tolerance = 1e-6;     ///< certified tier: see CertifiedOptions
  double min_separation = 0;   ///< scene units; 0 in the fast tier, which tests touching
  std::uint32_t budget = 512;  ///< certified tier: windows examined before the answer is kBudget
  double latest = 1;           ///< later contacts are not searched for (Report::kEarliest)
};

/// Accumulated cost of the tests of a thread or a step.
struct ElementaryCounts {
  std::uint64_t exact_tests = 0;  ///< pairs that only exact integers could decide
};

/// Do the primitives meet during the step, and when first? `options` must have passed validate().
Verdict elementary_test(const FeatureVertices& features, const ElementaryOptions& options,
                        ElementaryCounts& counts);

}  // namespace warmfront
