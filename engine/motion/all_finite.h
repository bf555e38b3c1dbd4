// SPDX-License-Identifier: Apache-2.0
// Whether all of many numbers are finite, in lanes. Pure functions.
#pragma once

#include <cstddef>

namespace warmfront {

bool all_finite(const float* numbers, std::size_t count);
bool all_finite(const double* numbers, std::size_t count);

}  // namespace warmfront
