// SPDX-License-Identifier: Apache-2.0
#include "engine/bounds/overlap.h"

#include "engine/bounds/lanes.h"

namespace warmfront {
namespace {

template <class Bounds>
WARMFRONT_INLINE std::uint32_t meet_many(const Bounds& one, std::span<const Bounds> many) {
  std::uint32_t bits = 0;
  for (std::size_t j = 0; j < many.size(); ++j) bits |= static_cast<std::uint32_t>(meet(one, many[j])) << j;
  return bits;
}

}  // namespace

WARMFRONT_TARGET_CLONES
bool overlap(const Aabb& a, const Aabb& b) {
  return meet(a, b);
}

WARMFRONT_TARGET_CLONES
bool overlap(const KDop18& a, const KDop18& b) {
  return meet(a, b);
}

WARMFRONT_TARGET_CLONES
std::uint32_t overlaps(const Aabb& one, std::span<const Aabb> many) {
  return meet_many(one, many);
}

WARMFRONT_TARGET_CLONES
std::uint32_t overlaps(const KDop18& one, std::span<const KDop18> many) {
  return meet_many(one, many);
}

WARMFRONT_TARGET_CLONES
std::uint32_t overlapping_features(const TriangleBounds& f, const TriangleBounds& g, std::uint32_t wanted) {
  const Registers vf[3] = {registers(*f.vertex[0]), registers(*f.vertex[1]), registers(*f.vertex[2])};
  const Registers vg[3] = {registers(*g.vertex[0]), registers(*g.vertex[1]), registers(*g.vertex[2])};
  std::uint32_t bits = 0;
  if ((wanted & 7U) != 0) {
    const Registers face = merged(merged(vg[0], vg[1]), vg[2]);
    for (int i = 0; i < 3; ++i) bits |= static_cast<std::uint32_t>(meet(vf[i], face)) << i;
  }
  if ((wanted & 070U) != 0) {
    const Registers face = merged(merged(vf[0], vf[1]), vf[2]);
    for (int i = 0; i < 3; ++i) bits |= static_cast<std::uint32_t>(meet(vg[i], face)) << (3 + i);
  }
  if ((wanted >> 6) != 0) {
    const Registers edges[3] = {merged(vg[0], vg[1]), merged(vg[1], vg[2]), merged(vg[2], vg[0])};
    for (int i = 0; i < 3; ++i) {
      if (((wanted >> (6 + 3 * i)) & 7U) == 0) continue;
      const Registers edge = merged(vf[i], vf[(i + 1) % 3]);
      for (int j = 0; j < 3; ++j) bits |= static_cast<std::uint32_t>(meet(edge, edges[j])) << (6 + 3 * i + j);
    }
  }
  return bits & wanted;
}

}  // namespace warmfront
