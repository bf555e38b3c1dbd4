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

using Int8 = std::int32_t __attribute__((vector_size(32)));

// The first eight axes of a feature's bounds.
struct EightAxes {
  Float8 lower;
  Float8 upper;
};

WARMFRONT_INLINE Float8 lesser(Float8 a, Float8 b) {
  return a < b ? a : b;
}

WARMFRONT_INLINE EightAxes eight_axes(const KDop18& k) {
  return {load<Float8>(&k.lane[0]), load<Float8>(&k.lane[9])};
}

WARMFRONT_INLINE EightAxes merged(const EightAxes& a, const EightAxes& b) {
  return {lesser(a.lower, b.lower), lesser(a.upper, b.upper)};
}

// Sets `bit` in some lane when some axis keeps a and b apart.
WARMFRONT_INLINE void mark_apart(const EightAxes& a, const EightAxes& b, std::int32_t bit, Int8& marks) {
  const Float8 low = a.lower + b.upper;
  const Float8 high = a.upper + b.lower;
  marks |= (Int8)((low > high ? low : high) > 0.0F) & bit;
}

// One lane of a triangle's features: its vertices, the face, its edges, and a lane of padding.
WARMFRONT_INLINE Float8 of_features(const TriangleBounds& t, int lane) {
  const float a = t.vertex[0]->lane[lane];
  const float b = t.vertex[1]->lane[lane];
  const float c = t.vertex[2]->lane[lane];
  const Float8 vertices{a, b, c, c, a, b, c, c};
  const Float8 edges = lesser(vertices, Float8{a, b, c, a, b, c, a, c});
  return lesser(edges, Float8{a, b, c, b, a, b, c, c});
}

// Bits, as in overlapping_features(), of the feature pairs whose bounds are apart. The first eight axes go
// pair by pair, an axis a lane; of the ninth each lane is a pair. No branches: which features a pair of
// triangles owns is close to random.
WARMFRONT_INLINE std::uint32_t features_apart(const TriangleBounds& f, const TriangleBounds& g) {
  const EightAxes vf[3] = {eight_axes(*f.vertex[0]), eight_axes(*f.vertex[1]), eight_axes(*f.vertex[2])};
  const EightAxes vg[3] = {eight_axes(*g.vertex[0]), eight_axes(*g.vertex[1]), eight_axes(*g.vertex[2])};
  const EightAxes ef[3] = {merged(vf[0], vf[1]), merged(vf[1], vf[2]), merged(vf[2], vf[0])};
  const EightAxes eg[3] = {merged(vg[0], vg[1]), merged(vg[1], vg[2]), merged(vg[2], vg[0])};
  const EightAxes face_f = merged(ef[0], vf[2]);
  const EightAxes face_g = merged(eg[0], vg[2]);
  Int8 marks{};
  for (int i = 0; i < 3; ++i) {
    mark_apart(vf[i], face_g, 1 << i, marks);
    mark_apart(vg[i], face_f, 8 << i, marks);
    for (int j = 0; j < 3; ++j) mark_apart(ef[i], eg[j], 64 << (3 * i + j), marks);
  }

  // Lanes of of_features() for feature pairs 0-7 and 8-14.
  constexpr Int8 kOfF[2] = {{0, 1, 2, 3, 3, 3, 4, 4}, {4, 5, 5, 5, 6, 6, 6, 7}};
  constexpr Int8 kOfG[2] = {{3, 3, 3, 0, 1, 2, 4, 5}, {6, 4, 5, 6, 4, 5, 6, 7}};
  constexpr Int8 kBit[2] = {{1, 2, 4, 8, 16, 32, 64, 128}, {256, 512, 1024, 2048, 4096, 8192, 16384, 0}};
  const Float8 lower_f = of_features(f, 8);
  const Float8 upper_f = of_features(f, 17);
  const Float8 lower_g = of_features(g, 8);
  const Float8 upper_g = of_features(g, 17);
  for (int half = 0; half < 2; ++half) {
    const Float8 low = __builtin_shuffle(lower_f, kOfF[half]) + __builtin_shuffle(upper_g, kOfG[half]);
    const Float8 high = __builtin_shuffle(upper_f, kOfF[half]) + __builtin_shuffle(lower_g, kOfG[half]);
    marks |= (Int8)((low > high ? low : high) > 0.0F) & kBit[half];
  }
  const auto words = (Long4)marks;
  const auto both = static_cast<std::uint64_t>((words[0] | words[1]) | (words[2] | words[3]));
  return static_cast<std::uint32_t>(both | (both >> 32));
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
  return wanted & ~features_apart(f, g);
}

}  // namespace warmfront
