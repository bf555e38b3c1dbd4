// SPDX-License-Identifier: Apache-2.0
// A sum of zeros times numbers is zero, unless one of them is not finite: no compiler that keeps to IEEE may
// take that for granted.
#include "engine/motion/all_finite.h"

#include <array>

#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

/// Sums beside each other, because an addition takes as long as several loads.
constexpr std::size_t kSums = 4;

template <class Vector, class Real>
WARMFRONT_INLINE bool sums_are_zero(const Real* numbers, std::size_t count) {
  constexpr std::size_t kLanes = sizeof(Vector) / sizeof(Real);
  std::array<Vector, kSums> sums{};
  std::size_t at = 0;
  for (; at + kSums * kLanes <= count; at += kSums * kLanes)
    for (std::size_t k = 0; k < kSums; ++k)
      sums[k] = sums[k] + load<Vector>(numbers + at + k * kLanes) * Real{0};
  Real rest = 0;
  for (; at < count; ++at) rest += numbers[at] * Real{0};
  const Vector sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  for (std::size_t lane = 0; lane < kLanes; ++lane) rest += sum[static_cast<int>(lane)];
  return rest == 0;
}

}  // namespace

WARMFRONT_TARGET_CLONES
bool all_finite(const float* numbers, std::size_t count) {
  return sums_are_zero<Float8>(numbers, count);
}

WARMFRONT_TARGET_CLONES
bool all_finite(const double* numbers, std::size_t count) {
  return sums_are_zero<Double4>(numbers, count);
}

}  // namespace warmfront
