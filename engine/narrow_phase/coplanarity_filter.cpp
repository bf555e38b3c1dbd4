// SPDX-License-Identifier: Apache-2.0
#include "engine/narrow_phase/coplanarity_filter.h"

#include <algorithm>
#include <cmath>

#include "engine/elementary/vec3.h"
#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

constexpr int kLanes = 8;

using Lanes = std::array<double, kLanes>;

// Vertices 1..3 relative to vertex 0, at both times, pair by pair in lanes.
struct Differences {
  alignas(64) Lanes at[2][3][3];  // [time][vertex - 1][axis]
};

WARMFRONT_INLINE void gather(const FeaturePair& pair, std::span<const VertexMotion> vertices, Differences& to,
                             int lane) {
  const VertexMotion& base = vertices[pair.vertices[0]];
  for (int k = 0; k < 3; ++k) {
    const VertexMotion& other = vertices[pair.vertices[k + 1]];
    for (int axis = 0; axis < 3; ++axis) {
      to.at[0][k][axis][lane] = other.t0[axis] - base.t0[axis];
      to.at[1][k][axis][lane] = other.t1[axis] - base.t1[axis];
    }
  }
}

// Bit i is set where pair i's cubic has coefficients certainly of one sign.
template <bool kSeparated>
WARMFRONT_INLINE unsigned certainly_apart(const Differences& d, std::span<const FeaturePair> pairs,
                                          const double* separations) {
  alignas(64) std::array<double, kLanes> apart;
  alignas(64) std::array<double, kLanes> edge_edge{};
  alignas(64) std::array<double, kLanes> separation{};
  if constexpr (kSeparated) {
    for (int i = 0; i < static_cast<int>(pairs.size()); ++i) {
      edge_edge[i] = pairs[i].kind != ContactKind::kVertexFace;
      separation[i] = separations[i];
    }
  }
  for (int i = 0; i < kLanes; ++i) {
    const auto at = [&](int time, int vertex) {
      return Vec3{d.at[time][vertex][0][i], d.at[time][vertex][1][i], d.at[time][vertex][2][i]};
    };
    const Vec3 e0 = at(0, 0), g0 = at(0, 1), q0 = at(0, 2);
    const Vec3 e1 = at(1, 0), g1 = at(1, 1), q1 = at(1, 2);
    const Vec3 c00 = cross(g0, q0);
    const Vec3 c11 = cross(g1, q1);
    const Vec3 c01 = cross(g0, q1) + cross(g1, q0);
    const double k0 = dot(e0, c00);
    const double k1 = (dot(e1, c00) + dot(e0, c01)) * (1.0 / 3);
    const double k2 = (dot(e0, c11) + dot(e1, c01)) * (1.0 / 3);
    const double k3 = dot(e1, c11);
    const auto largest = [](const Vec3& a, const Vec3& b) {
      const auto up = [](double x, double y) { return x > y ? x : y; };
      return up(up(up(std::fabs(a.x), std::fabs(a.y)), up(std::fabs(a.z), std::fabs(b.x))),
                up(std::fabs(b.y), std::fabs(b.z)));
    };
    const double e = largest(e0, e1);
    const double g = largest(g0, g1);
    const double q = largest(q0, q1);
    // As in Cubic; one rounding more for the product with 1/3. Products that underflow err by less than
    // 2^-1074 times a coordinate each; products that overflow make the bound infinite or NaN, and the pair
    // survives. The product of two may underflow where that of all three does not: the greatest of the three
    // orders is right.
    const auto greater = [](double x, double y) { return x > y ? x : y; };
    const double product = greater(greater((e * g) * q, (g * q) * e), (q * e) * g);
    double bound = 120 * kUnit * product + 0x1p-1000 * (1 + e);
    if constexpr (kSeparated) {
      // |f| <= separation * |n| in contact; |n| <= |p| |r| <= 3 |p|inf |r|inf for the two vectors with
      // product n: vertex-face: differences of face vertices, at most e + g and e + q; edge-edge: e and q -
      // g.
      const double normal = edge_edge[i] != 0 ? 3 * e * (g + q) : 3 * (e + g) * (e + q);
      bound += separation[i] * normal * (1 + 0x1p-48);
    }
    const double lo = std::min(std::min(k0, k1), std::min(k2, k3));
    const double hi = std::max(std::max(k0, k1), std::max(k2, k3));
    // The minimum may ignore a NaN coefficient; the sum does not.
    const bool finite = std::fabs(k0 + k1 + k2 + k3) < 0x1p1000;
    apart[i] = finite && (lo > bound || hi < -bound) ? 1.0 : 0.0;
  }
  unsigned mask = 0;
  for (int i = 0; i < kLanes; ++i) mask |= (apart[i] != 0 ? 1U : 0U) << i;
  return mask;
}

template <bool kSeparated>
WARMFRONT_INLINE std::size_t filter(std::span<const FeaturePair> pairs,
                                    std::span<const VertexMotion> vertices, const double* separations,
                                    std::uint16_t* survivors) {
  std::size_t count = 0;
  Differences differences{};
  for (std::size_t first = 0; first < pairs.size(); first += kLanes) {
    const std::size_t lanes = std::min<std::size_t>(kLanes, pairs.size() - first);
    for (std::size_t i = 0; i < lanes; ++i)
      gather(pairs[first + i], vertices, differences, static_cast<int>(i));
    const unsigned apart = certainly_apart<kSeparated>(differences, pairs.subspan(first, lanes),
                                                       kSeparated ? separations + first : nullptr);
    for (std::size_t i = 0; i < lanes; ++i) {
      survivors[count] = static_cast<std::uint16_t>(first + i);
      count += ((apart >> i) & 1U) == 0;
    }
  }
  return count;
}

WARMFRONT_TARGET_CLONES
std::size_t filter_touching(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices,
                            std::uint16_t* survivors) {
  return filter<false>(pairs, vertices, nullptr, survivors);
}

WARMFRONT_TARGET_CLONES
std::size_t filter_separated(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices,
                             const double* separations, std::uint16_t* survivors) {
  return filter<true>(pairs, vertices, separations, survivors);
}

}  // namespace

std::size_t coplanarity_filter(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices,
                               std::span<const double> separations, std::uint16_t* survivors) {
  return separations.empty() ? filter_touching(pairs, vertices, survivors)
                             : filter_separated(pairs, vertices, separations.data(), survivors);
}

}  // namespace warmfront
