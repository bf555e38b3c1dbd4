// SPDX-License-Identifier: Apache-2.0
// The oracle for everything between the scene and the elementary test: tests every valid feature pair, one by
// one.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/contact.h"
#include "engine/elementary/certified.h"
#include "engine/elementary/exact.h"
#include "engine/elementary/exact_near.h"
#include "engine/elementary/turning.h"
#include "engine/motion/motion.h"
#include "engine/narrow_phase/separation_filter.h"
#include "engine/scene.h"

namespace warmfront::testing {

/// Calls `visit(kind, a, b)` for every pair (v, f) with v not in f and every pair of edges a < b that share
/// no vertex.
template <class Visit>
void for_all_feature_pairs(const Scene& scene, Visit&& visit) {
  for (std::uint32_t v = 0; v < scene.vertex_count(); ++v) {
    for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
      const Face& face = scene.faces()[f];
      if (face[0] != v && face[1] != v && face[2] != v) visit(ContactKind::kVertexFace, v, f);
    }
  }
  for (std::uint32_t a = 0; a < scene.edge_count(); ++a) {
    for (std::uint32_t b = a + 1; b < scene.edge_count(); ++b) {
      const Edge& x = scene.edges()[a];
      const Edge& y = scene.edges()[b];
      if (x[0] != y[0] && x[0] != y[1] && x[1] != y[0] && x[1] != y[1]) visit(ContactKind::kEdgeEdge, a, b);
    }
  }
}

/// Calls `visit(kind, a, b)` for all pairs of points, and of points and lone edges: those that count where
/// what does not touch may be in contact.
template <class Visit>
void for_all_point_pairs(const Scene& scene, Visit&& visit) {
  const auto points = scene.isolated_vertices();
  for (const std::uint32_t v : points)
    for (const std::uint32_t e : scene.lone_edges()) visit(ContactKind::kVertexEdge, v, e);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j)
      visit(ContactKind::kVertexVertex, points[i], points[j]);
}

/// Both, in the order of contacts.
template <class Visit>
void for_all_pairs(const Scene& scene, bool with_points, Visit&& visit) {
  for_all_feature_pairs(scene, visit);
  if (with_points) for_all_point_pairs(scene, visit);
}

inline FeatureVertices features_of(const Scene& scene, std::span<const VertexMotion> vertices,
                                   ContactKind kind, std::uint32_t a, std::uint32_t b) {
  FeatureVertices features{tested_as(kind), {}};
  const auto ids = scene.vertices_of({kind, ContactStatus::kHit, a, b, 0});
  for (int k = 0; k < 4; ++k) features.vertex[k] = &vertices[ids[k]];
  return features;
}

inline std::vector<VertexMotion> motion_between(std::span<const double> x0, std::span<const double> x1) {
  std::vector<VertexMotion> vertices(x0.size() / 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    vertices[v].t0 = {x0[3 * v], x0[3 * v + 1], x0[3 * v + 2], 0};
    vertices[v].t1 = {x1[3 * v], x1[3 * v + 1], x1[3 * v + 2], 0};
  }
  return vertices;
}

/// The least allowed magnitude, which gives the thinnest margins.
inline double least_magnitude(std::span<const VertexMotion> vertices, const LocalTransform& frame,
                              double separation) {
  double magnitude = frame.to_local(separation);
  for (const VertexMotion& vertex : vertices) {
    for (const auto& x : {vertex.t0, vertex.t1}) {
      for (int axis = 0; axis < 3; ++axis)
        magnitude =
            std::max(magnitude, std::fabs(frame.to_local(x[axis]) - frame.to_local(frame.origin[axis])));
    }
  }
  return magnitude;
}

/// The bodies that move along screws in a step, by body; those of others do not turn.
using Twists = std::vector<Twist>;

/// The twist of the body that a vertex is in; null where that moves along lines.
inline const Twist* twist_around(const Twists& twists, const Scene& scene, std::uint32_t vertex) {
  if (twists.empty()) return nullptr;
  const Twist& twist = twists[scene.body_of_vertex()[vertex]];
  return twist.angle_squared > 0 ? &twist : nullptr;
}

inline TurningPair turning_pair(const Scene& scene, const Twists& twists, const FeatureVertices& features,
                                ContactKind kind, std::uint32_t a, std::uint32_t b) {
  const auto ids = scene.vertices_of({kind, ContactStatus::kHit, a, b, 0});
  return {features, twist_around(twists, scene, ids[0]), twist_around(twists, scene, ids[3])};
}

/// May a step leave out the pair, though the certified test reports it? The filter before that test is part
/// of a step's answer, and sometimes proves apart what certified cannot tell apart; of what meets, never.
inline bool left_out_by_filter(const FeatureVertices& features) {
  std::uint64_t exact_tests = 0;
  if (exact_test(features, 1, exact_tests).contact) return false;
  std::array<VertexMotion, 4> four;
  for (std::size_t k = 0; k < 4; ++k) four[k] = *features.vertex[k];
  const FeaturePair pair{{0, 1, 2, 3}, 0, 0, features.kind};
  std::uint16_t survivor = 0;
  return separation_filter({&pair, 1}, four, &survivor, 1) == 0;
}

/// All contacts of the motion from x0 to x1, sorted as a Collider sorts them.
inline std::vector<Contact> brute_force(const Scene& scene, std::span<const double> x0,
                                        std::span<const double> x1, const CertifiedOptions& options,
                                        const Twists& twists = {}) {
  const std::vector<VertexMotion> vertices = motion_between(x0, x1);
  std::vector<Contact> contacts;
  for_all_pairs(scene, options.min_separation > 0, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const FeatureVertices features = features_of(scene, vertices, kind, a, b);
    const TurningPair turning = turning_pair(scene, twists, features, kind, a, b);
    const bool turns = turning.first != nullptr || turning.second != nullptr;
    const Verdict verdict = turns ? turning_test(turning, options) : certified_test(features, options);
    const bool filtered = !turns && options.min_separation == 0;
    if (verdict.contact && !(filtered && left_out_by_filter(features)))
      contacts.push_back({kind, verdict.status, a, b, verdict.toi});
  });
  return contacts;
}

/// All pairs that come within the separation, as the exact tier finds them; > 0.
inline std::vector<Contact> brute_force_exact(const Scene& scene, std::span<const double> x0,
                                              std::span<const double> x1, double separation) {
  const std::vector<VertexMotion> vertices = motion_between(x0, x1);
  std::vector<Contact> contacts;
  std::uint64_t exact_tests = 0;
  for_all_pairs(scene, true, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const Verdict verdict =
        exact_near_test(features_of(scene, vertices, kind, a, b), separation, 1, exact_tests);
    if (verdict.contact) contacts.push_back({kind, verdict.status, a, b, verdict.toi});
  });
  return contacts;
}

}  // namespace warmfront::testing
