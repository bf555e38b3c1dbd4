// SPDX-License-Identifier: Apache-2.0
// Names of GCC that the engine uses and clang does not know, included before everything in clang builds.
// Those builds look for faults and are not measured, so the plain loop will do. Pure functions.
#pragma once

/// Lane i is lane mask[i] of `a`.
template <class Vector, class Mask>
inline Vector __builtin_shuffle(Vector a, Mask mask) {
  constexpr int kLanes = sizeof(a) / sizeof(a[0]);
  Vector shuffled = a;
  for (int i = 0; i < kLanes; ++i) shuffled[i] = a[mask[i] % kLanes];
  return shuffled;
}

/// Lane i is lane mask[i] of `a` followed by `b`.
template <class Vector, class Mask>
inline Vector __builtin_shuffle(Vector a, Vector b, Mask mask) {
  constexpr int kLanes = sizeof(a) / sizeof(a[0]);
  Vector shuffled = a;
  for (int i = 0; i < kLanes; ++i) {
    const int from = static_cast<int>(mask[i] % (2 * kLanes));
    shuffled[i] = from < kLanes ? a[from] : b[from - kLanes];
  }
  return shuffled;
}
