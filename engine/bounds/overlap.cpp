// SPDX-License-Identifier: Apache-2.0
#include "engine/bounds/overlap.h"

#include "engine/bounds/bounds_lanes.h"

namespace warmfront {
namespace {

// Eight axes of a feature's bounds at both ends of the step.
struct Feature {
  EightAxes at0;
  EightAxes at1;
};

WARMFRONT_INLINE Feature feature(const PointBounds& point) {
  return {eight_axes(point, 0), eight_axes(point, 1)};
}

WARMFRONT_INLINE Feature merged(const Feature& a, const Feature& b) {
  return {merged(a.at0, b.at0), merged(a.at1, b.at1)};
}

// Sets `bit`, or a lane's bit, in lanes of axes that separate a and b.
template <class When, class Bit>
WARMFRONT_INLINE void mark_apart(When open, const Feature& a, const Feature& b, const Float8& width, Bit bit,
                                 Int8& marks) {
  marks |= (Int8)(gap(open, a.at0, a.at1, b.at0, b.at1, width) > 0.0F) & bit;
}

// The ends along the ninth axis.
WARMFRONT_INLINE SlabEnds<float> ninth(const PointBounds& point, std::size_t t) {
  const auto& [x, y, z, margin] = point.at[t];
  return slab_ends(8, x, y, z, margin);
}

// Along the ninth axis, a triangle's features: its vertices, the face, its edges, and a lane of padding.
WARMFRONT_INLINE EightAxes ninth_of_features(const TriangleBounds& triangle, std::size_t t) {
  const auto of_features = [](float a, float b, float c) {
    const Float8 vertices{a, b, c, c, a, b, c, c};
    const Float8 edges = lesser(vertices, Float8{a, b, c, a, b, c, a, c});
    return lesser(edges, Float8{a, b, c, b, a, b, c, c});
  };
  const SlabEnds<float> a = ninth(*triangle.vertex[0], t);
  const SlabEnds<float> b = ninth(*triangle.vertex[1], t);
  const SlabEnds<float> c = ninth(*triangle.vertex[2], t);
  return {of_features(a.lower, b.lower, c.lower), of_features(a.upper, b.upper, c.upper)};
}

WARMFRONT_INLINE Feature face(const TriangleBounds& t) {
  return merged(merged(feature(*t.vertex[0]), feature(*t.vertex[1])), feature(*t.vertex[2]));
}

// Does the ninth axis separate two triangles?
WARMFRONT_INLINE bool apart_along_ninth(const TriangleBounds& f, const TriangleBounds& g, float width) {
  const auto ends = [](const TriangleBounds& triangle, std::size_t t) {
    SlabEnds<float> all = ninth(*triangle.vertex[0], t);
    for (int i = 1; i < 3; ++i) {
      const SlabEnds<float> one = ninth(*triangle.vertex[i], t);
      all = {lesser(all.lower, one.lower), lesser(all.upper, one.upper)};
    }
    return all;
  };
  const SlabEnds<float> f0 = ends(f, 0);
  const SlabEnds<float> f1 = ends(f, 1);
  const SlabEnds<float> g0 = ends(g, 0);
  const SlabEnds<float> g1 = ends(g, 1);
  return ((f0.lower + g0.upper > width) & (f1.lower + g1.upper > width)) |
         ((f0.upper + g0.lower > width) & (f1.upper + g1.lower > width));
}

template <int... kLane>
WARMFRONT_INLINE EightAxes shuffled(const EightAxes& ends) {
  return {shuffle<kLane...>(ends.lower, ends.lower), shuffle<kLane...>(ends.upper, ends.upper)};
}

// Bits, as in overlapping_features(), of the feature pairs whose bounds are apart. For the first eight axes a
// lane is an axis and the loop runs over pairs; for the ninth a lane is a pair. Branchless: which features a
// pair of triangles owns is nearly random.
template <class When>
WARMFRONT_INLINE std::uint32_t features_apart(When open, const TriangleBounds& f, const TriangleBounds& g,
                                              const Width& width) {
  const Float8 widths = eight_axes(width);
  const Float8 along_ninth = Float8{} + width.diagonal;
  const Feature vf[3] = {feature(*f.vertex[0]), feature(*f.vertex[1]), feature(*f.vertex[2])};
  const Feature vg[3] = {feature(*g.vertex[0]), feature(*g.vertex[1]), feature(*g.vertex[2])};
  const Feature ef[3] = {merged(vf[0], vf[1]), merged(vf[1], vf[2]), merged(vf[2], vf[0])};
  const Feature eg[3] = {merged(vg[0], vg[1]), merged(vg[1], vg[2]), merged(vg[2], vg[0])};
  const Feature face_f = merged(ef[0], vf[2]);
  const Feature face_g = merged(eg[0], vg[2]);
  Int8 marks{};
  for (int i = 0; i < 3; ++i) {
    mark_apart(open, vf[i], face_g, widths, 1 << i, marks);
    mark_apart(open, vg[i], face_f, widths, 8 << i, marks);
    for (int j = 0; j < 3; ++j) mark_apart(open, ef[i], eg[j], widths, 64 << (3 * i + j), marks);
  }

  // Lanes of ninth_of_features() for feature pairs 0-7 and 8-14.
  constexpr Int8 kBit[2] = {{1, 2, 4, 8, 16, 32, 64, 128}, {256, 512, 1024, 2048, 4096, 8192, 16384, 0}};
  const EightAxes of_f[2] = {ninth_of_features(f, 0), ninth_of_features(f, 1)};
  const EightAxes of_g[2] = {ninth_of_features(g, 0), ninth_of_features(g, 1)};
  mark_apart(open, {shuffled<0, 1, 2, 3, 3, 3, 4, 4>(of_f[0]), shuffled<0, 1, 2, 3, 3, 3, 4, 4>(of_f[1])},
             {shuffled<3, 3, 3, 0, 1, 2, 4, 5>(of_g[0]), shuffled<3, 3, 3, 0, 1, 2, 4, 5>(of_g[1])},
             along_ninth, kBit[0], marks);
  mark_apart(open, {shuffled<4, 5, 5, 5, 6, 6, 6, 7>(of_f[0]), shuffled<4, 5, 5, 5, 6, 6, 6, 7>(of_f[1])},
             {shuffled<6, 4, 5, 6, 4, 5, 6, 7>(of_g[0]), shuffled<6, 4, 5, 6, 4, 5, 6, 7>(of_g[1])},
             along_ninth, kBit[1], marks);
  return ored(marks);
}

WARMFRONT_TARGET_CLONES
bool triangles_overlap(const TriangleBounds& f, const TriangleBounds& g, const Width& width) {
  const Feature a = face(f);
  const Feature b = face(g);
  const auto apart = (Int8)(gap(Throughout{}, a.at0, a.at1, b.at0, b.at1, eight_axes(width)) > 0.0F);
  return !any(apart) && !apart_along_ninth(f, g, width.diagonal);
}

}  // namespace

WARMFRONT_TARGET_CLONES
bool overlap(const Aabb& a, const Aabb& b, const Width& width) {
  return meet(a, b, width);
}

WARMFRONT_TARGET_CLONES
bool overlap(const KDop18& a, const KDop18& b, const Width& width) {
  return meet(a, b, width);
}

template <>
bool overlap<KDop18>(const TriangleBounds& f, const TriangleBounds& g, const Width& width) {
  return triangles_overlap(f, g, width);
}

template <>
bool overlap<Aabb>(const TriangleBounds& f, const TriangleBounds& g, const Width& width) {
  const auto face = [](const TriangleBounds& t) {
    Aabb bounds = narrow<Aabb>(bounds_of(*t.vertex[0]));
    bounds.merge(narrow<Aabb>(bounds_of(*t.vertex[1])));
    bounds.merge(narrow<Aabb>(bounds_of(*t.vertex[2])));
    return bounds;
  };
  return overlap(face(f), face(g), width);
}

WARMFRONT_TARGET_CLONES
float separation(const Aabb& a, const Aabb& b, GapAt at, const Width& width) {
  return at == GapAt::kEnd ? gap_at<Aabb::kEnd>(a, b, width) : gap_at<0>(a, b, width);
}

WARMFRONT_TARGET_CLONES
float separation(const KDop18& a, const KDop18& b, GapAt at, const Width& width) {
  return at == GapAt::kEnd ? gap_at<KDop18::kEnd>(a, b, width) : gap_at<0>(a, b, width);
}

WARMFRONT_TARGET_CLONES
std::uint32_t overlapping_features(const TriangleBounds& f, const TriangleBounds& g, std::uint32_t wanted,
                                   const Width& width) {
  return wanted & ~features_apart(Throughout{}, f, g, width);
}

WARMFRONT_TARGET_CLONES
std::uint32_t overlapping_features(const TriangleBounds& f, const TriangleBounds& g, std::uint32_t wanted,
                                   float until, const Width& width) {
  return wanted & ~features_apart(Until{until, width.diagonal}, f, g, width);
}

}  // namespace warmfront
