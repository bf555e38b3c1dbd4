// SPDX-License-Identifier: Apache-2.0
#include "tests/support/pair_rules.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "engine/elementary/edge_face.h"
#include "engine/motion/motion.h"
#include "tests/support/near_oracle.h"

namespace warmfront::testing {
namespace {

constexpr std::uint32_t kFar = 1000;

}  // namespace

PairRules::PairRules(const Scene& scene, PairFilters filters)
    : scene_(scene),
      filters_(std::move(filters)),
      edges_between_(scene.vertex_count(), std::vector<std::uint32_t>(scene.vertex_count(), kFar)) {
  std::vector<std::vector<std::uint32_t>> next(scene.vertex_count());
  for (const Edge& edge : scene.edges()) {
    next[edge[0]].push_back(edge[1]);
    next[edge[1]].push_back(edge[0]);
  }
  for (std::uint32_t from = 0; from < scene.vertex_count(); ++from) {
    std::vector<std::uint32_t>& edges = edges_between_[from];
    std::vector<std::uint32_t> reached{from};
    edges[from] = 0;
    for (std::size_t i = 0; i < reached.size(); ++i) {
      for (const std::uint32_t v : next[reached[i]]) {
        if (edges[v] != kFar) continue;
        edges[v] = edges[reached[i]] + 1;
        reached.push_back(v);
      }
    }
  }
}

bool PairRules::leave_out(const Contact& contact) const {
  std::vector<std::uint32_t> a, b;
  if (contact.kind == ContactKind::kEdgeFace) {
    const auto v = scene_.edge_face_vertices_of(contact);
    a.assign(v.begin(), v.begin() + 2);
    b.assign(v.begin() + 2, v.end());
  } else {
    const auto v = scene_.vertices_of(contact);
    const auto of_a = static_cast<std::ptrdiff_t>(vertices_of_first(contact.kind));
    a.assign(v.begin(), v.begin() + of_a);
    b.assign(v.begin() + of_a, v.end());
  }
  const auto any_two = [&](auto&& rule) {
    return std::ranges::any_of(a, [&](std::uint32_t v) {
      return std::ranges::any_of(b, [&](std::uint32_t w) { return rule(v, w); });
    });
  };
  if (any_two(
          [&](std::uint32_t v, std::uint32_t w) { return edges_between_[v][w] <= filters_.within_edges; }))
    return true;
  const auto listed = [&](std::uint32_t v, std::uint32_t w) {
    return std::ranges::any_of(filters_.excluded_vertex_pairs, [&](const auto& pair) {
      return (pair[0] == v && pair[1] == w) || (pair[0] == w && pair[1] == v);
    });
  };
  if (any_two(listed)) return true;
  if (!filters_.patches.empty()) {
    std::vector<std::uint32_t> patches;
    for (const auto* of : {&a, &b}) {
      for (const std::uint32_t v : *of) patches.push_back(filters_.patches[v]);
    }
    if (patches.front() != 0 && std::ranges::count(patches, patches.front()) == std::ssize(patches))
      return true;
  }
  if (!(filters_.near_at_rest > 0)) return false;
  const auto [known, is_new] = near_at_rest_.try_emplace({contact.kind, contact.a, contact.b}, false);
  if (is_new) known->second = are_near_at_rest(contact.kind, a, b);
  return known->second;
}

bool PairRules::are_near_at_rest(ContactKind kind, const std::vector<std::uint32_t>& a,
                                 const std::vector<std::uint32_t>& b) const {
  std::array<VertexMotion, 5> standing{};
  const auto stand = [&](std::size_t k, std::uint32_t v) {
    const double* x = filters_.rest_positions.data() + std::size_t{3} * v;
    standing[k].t0 = standing[k].t1 = {x[0], x[1], x[2], 0};
  };
  for (std::size_t k = 0; k < a.size(); ++k) stand(k, a[k]);
  for (std::size_t k = 0; k < b.size(); ++k) stand(a.size() + k, b[k]);
  // The oracle is slow, and not needed for pairs that their boxes decide.
  for (int axis = 0; axis < 3; ++axis) {
    const auto less = [axis](const VertexMotion& x, const VertexMotion& y) {
      return x.t0[axis] < y.t0[axis];
    };
    const std::span<const VertexMotion> of_a(standing.data(), a.size());
    const std::span<const VertexMotion> of_b(standing.data() + a.size(), b.size());
    const double gap =
        std::max(std::ranges::min(of_b, less).t0[axis] - std::ranges::max(of_a, less).t0[axis],
                 std::ranges::min(of_a, less).t0[axis] - std::ranges::max(of_b, less).t0[axis]);
    if (gap > 1.001 * filters_.near_at_rest) return false;
  }
  if (kind == ContactKind::kEdgeFace) {
    for (const std::uint32_t v : a) {
      if (are_near_at_rest(ContactKind::kVertexFace, {v}, b)) return true;
    }
    for (std::size_t side = 0; side < 3; ++side) {
      if (are_near_at_rest(ContactKind::kEdgeEdge, a, {b[side], b[(side + 1) % 3]})) return true;
    }
    std::uint64_t exact_tests = 0;
    return edge_meets_face({&standing[0], &standing[1], &standing[2], &standing[3], &standing[4]},
                           Instant::kStart, exact_tests);
  }
  FeatureVertices features{tested_as(kind), {}};
  for (std::size_t k = 0; k < 4; ++k) features.vertex[k] = &standing[k];
  return near_truth(features, filters_.near_at_rest).contact;
}

}  // namespace warmfront::testing
