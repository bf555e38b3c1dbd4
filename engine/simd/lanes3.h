// SPDX-License-Identifier: Apache-2.0
// Vectors of three coordinates, many points at once, one per lane. Only for sources that dispatch by
// instruction set.
#pragma once

#include "engine/simd/lanes.h"

namespace warmfront {

template <class Lanes>
struct Lanes3 {
  Lanes x;
  Lanes y;
  Lanes z;
};

template <class Lanes>
WARMFRONT_INLINE Lanes3<Lanes> operator+(const Lanes3<Lanes>& a, const Lanes3<Lanes>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Lanes>
WARMFRONT_INLINE Lanes3<Lanes> operator-(const Lanes3<Lanes>& a, const Lanes3<Lanes>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Lanes>
WARMFRONT_INLINE Lanes3<Lanes> cross(const Lanes3<Lanes>& a, const Lanes3<Lanes>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class Lanes>
WARMFRONT_INLINE Lanes dot(const Lanes3<Lanes>& a, const Lanes3<Lanes>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Lanes>
WARMFRONT_INLINE Lanes3<Lanes> magnitudes(const Lanes3<Lanes>& v) {
  return {magnitude(v.x), magnitude(v.y), magnitude(v.z)};
}
template <class Lanes>
WARMFRONT_INLINE Lanes largest_of(const Lanes3<Lanes>& v) {
  return greater(greater(v.x, v.y), v.z);
}

}  // namespace warmfront
