// SPDX-License-Identifier: Apache-2.0
// Elementary queries with a separation at the extremes, in named families: seeded, endless. Some are made so
// that the primitives are exactly the separation apart at one eighth of the step, or for part of it, between
// every two kinds of sub-features; others put separations of every size on the families of torture.h. Their
// truth is near_truth(). Pure functions of the generator given.
#pragma once

#include <random>
#include <span>
#include <string>
#include <string_view>

#include "tests/support/feature_case.h"

namespace warmfront::testing {

struct NearCase {
  FeatureCase query;
  double separation;  ///< > 0
};

struct NearFamily {
  std::string_view name;
  NearCase (*make)(std::mt19937_64& random, ContactKind kind);
};

/// The families that are made for a separation, in a fixed order.
std::span<const NearFamily> near_families();

/// A separation for a query, often about as long as the primitives are apart at some time, or one of few
/// bits, the least or the largest of doubles, or the query's own size.
double any_separation(std::mt19937_64& random, const FeatureCase& query);

/// The case in C++'s hexadecimal floats.
std::string to_text(const NearCase& made);

}  // namespace warmfront::testing
