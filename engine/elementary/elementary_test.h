// SPDX-License-Identifier: Apache-2.0
// The one door to the elementary tests: a feature pair, through the whole cascade of a tier. A pure function
// but for the counts, safe to call from any thread that runs in the default floating-point environment
// (Workers sees to it).
#pragma once

#include <cstdint>

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"
#include "engine/options.h"

namespace warmfront {

struct ElementaryOptions {
  Tier tier = Tier::kCertified;
  double tolerance = 1e-6;     ///< certified tier: see CertifiedOptions
  double min_separation = 0;   ///< certified tier only, scene units; the others decide touching
  std::uint32_t budget = 512;  ///< certified tier: windows looked at before the answer is kBudget
  double latest = 1;           ///< contacts after this time are of no interest (Report::kEarliest)
};

/// What the tests of a thread or a step have cost, added up.
struct ElementaryCounts {
  std::uint64_t exact_tests = 0;  ///< pairs that only exact integers could decide
};

/// Do the primitives meet during the step, and when first? `options` as accepted by validate().
Verdict elementary_test(const FeatureVertices& features, const ElementaryOptions& options,
                        ElementaryCounts& counts);

}  // namespace warmfront
