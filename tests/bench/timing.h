// SPDX-License-Identifier: Apache-2.0
// Timing that the benchmarks share. Pure functions.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

namespace warmfront::testing {

/// Of at least one.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// What `work` returns; the milliseconds that it takes are appended.
template <class Work>
auto timed(std::vector<double>& ms, Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  auto result = work();
  ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  return result;
}

}  // namespace warmfront::testing
