// SPDX-License-Identifier: Apache-2.0
// Elementary queries at the extremes, in named families: seeded, endless, and made so that what is hard about
// each (a contact at a corner, at t = 0, within a plane, between denormals ...) holds to the last bit. Their
// truth is the exact oracle's. Pure functions of the generator given.
#pragma once

#include <random>
#include <span>
#include <string>
#include <string_view>

#include "tests/support/feature_case.h"

namespace warmfront::testing {

struct TortureFamily {
  std::string_view name;
  FeatureCase (*make)(std::mt19937_64& random, ContactKind kind);
};

/// All families, in a fixed order.
std::span<const TortureFamily> torture_families();

/// The query in C++'s hexadecimal floats, so that a failure can be pasted into a test.
std::string to_text(const FeatureCase& query);

}  // namespace warmfront::testing
