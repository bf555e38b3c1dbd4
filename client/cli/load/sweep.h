// SPDX-License-Identifier: Apache-2.0
// The values of a setting for consecutive loads. Pure functions.
#pragma once

#include <string_view>
#include <vector>

#include "engine/result.h"

namespace warmfront::client::load {

/// Reads "N", "FIRST:LAST:xFACTOR" (FIRST, FIRST * FACTOR, ... up to LAST) or "FIRST:LAST:+STEP". Numbers are
/// positive and finite, FACTOR above 1; with `whole`, values are rounded to integers without duplicates. At
/// most 1000 values. Errors say what is expected.
Result<std::vector<double>> parse_sweep(std::string_view text, bool whole);

}  // namespace warmfront::client::load
