// SPDX-License-Identifier: Apache-2.0
// A pair of features and its motion, put to the certified tier and to the filter before it.
#pragma once

#include <cstdint>

#include "engine/elementary/certified.h"
#include "engine/narrow_phase/coplanarity_filter.h"
#include "engine/narrow_phase/feature_block.h"
#include "tests/support/feature_case.h"

namespace warmfront::testing {

struct CertifiedCase : FeatureCase {
  using FeatureCase::FeatureCase;

  Verdict test(const CertifiedOptions& options = {}) const { return certified_test(features(), options); }
  bool survives_filter(double separation = 0) const {
    const FeaturePair pair{{0, 1, 2, 3}, 0, 0, kind};
    std::uint16_t survivor = 0;
    return coplanarity_filter({&pair, 1}, vertices, {&separation, separation > 0 ? 1U : 0U}, &survivor) == 1;
  }
};

}  // namespace warmfront::testing
