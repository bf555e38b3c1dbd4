// SPDX-License-Identifier: Apache-2.0
// Random numbers from a seed, the same on every machine, unlike the standard's distributions. Used by one
// thread at a time.
#pragma once

#include <cstdint>
#include <random>

namespace warmfront::testing {

/// 0 to n - 1.
inline int below(std::mt19937_64& random, int n) {
  return static_cast<int>(random() % static_cast<std::uint64_t>(n));
}
/// True once in n times.
inline bool one_in(std::mt19937_64& random, int n) {
  return below(random, n) == 0;
}
/// lo to hi.
inline int between(std::mt19937_64& random, int lo, int hi) {
  return lo + below(random, hi - lo + 1);
}

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}

  /// 0 to n - 1.
  int below(int n) { return testing::below(random_, n); }
  /// From -scale to scale.
  double uniform(double scale) { return scale * (static_cast<double>(random_() >> 11) * 0x1p-52 - 1); }

 protected:
  std::mt19937_64 random_;
};

}  // namespace warmfront::testing
