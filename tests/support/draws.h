// SPDX-License-Identifier: Apache-2.0
// Random numbers from a seed, the same on every machine, unlike the standard's distributions. Used by one
// thread at a time.
#pragma once

#include <cstdint>
#include <random>

namespace warmfront::testing {

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}

  /// 0 to n - 1.
  int below(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  /// From -scale to scale.
  double uniform(double scale) { return scale * (static_cast<double>(random_() >> 11) * 0x1p-52 - 1); }

 protected:
  std::mt19937_64 random_;
};

}  // namespace warmfront::testing
