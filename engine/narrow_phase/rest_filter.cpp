// SPDX-License-Identifier: Apache-2.0
#include "engine/narrow_phase/rest_filter.h"

#include <array>
#include <utility>

#include "engine/elementary/edge_face.h"
#include "engine/elementary/proximity.h"
#include "engine/narrow_phase/proximity_filter.h"

namespace warmfront {
namespace {

class AtRest {
 public:
  explicit AtRest(const PairFilter& filter) : filter_(filter) {}

  bool near(ContactKind kind, const std::array<std::uint32_t, 4>& vertices) const {
    std::array<VertexMotion, 4> standing;
    FeatureVertices features{kind, {}};
    for (std::size_t k = 0; k < 4; ++k) {
      standing[k] = standing_at(vertices[k]);
      features.vertex[k] = &standing[k];
    }
    ElementaryCounts counts;
    return proximity_test(features, Instant::kStart,
                          {.tier = Tier::kExact, .min_separation = filter_.rest_distance()}, counts)
        .contact;
  }

  bool meet(const Edge& edge, const Face& face) const {
    std::array<VertexMotion, 5> standing;
    EdgeFaceVertices vertices;
    for (std::size_t k = 0; k < 5; ++k) {
      standing[k] = standing_at(k < 2 ? edge[k] : face[k - 2]);
      vertices[k] = &standing[k];
    }
    std::uint64_t exact_tests = 0;
    return edge_meets_face(vertices, Instant::kStart, exact_tests);
  }

 private:
  VertexMotion standing_at(std::uint32_t v) const { return {filter_.at_rest(v), filter_.at_rest(v)}; }

  const PairFilter& filter_;
};

}  // namespace

std::size_t drop_near_at_rest(const PairFilter& filter, FeatureBlock& block) {
  const AtRest rest(filter);
  std::array<Nearness, FeatureBlock::kCapacity> nearness;
  proximity_filter({block.pairs.data(), block.size}, filter.rest_shape(), filter.rest_distance(),
                   nearness.data());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < block.size; ++i) {
    const FeaturePair& pair = block.pairs[i];
    const bool near = nearness[i] == Nearness::kNear ||
                      (nearness[i] == Nearness::kUnproved && rest.near(tested_as(pair.kind), pair.vertices));
    if (!near) block.pairs[kept++] = pair;
  }
  return block.size - std::exchange(block.size, kept);
}

bool is_near_at_rest(const PairFilter& filter, const Scene& scene, const FeaturePair& pair) {
  const AtRest rest(filter);
  // Unless they meet, an end of the edge or a side of the face is in their shortest connection.
  const auto [a, b] = scene.edges()[pair.a];
  const Face& face = scene.faces()[pair.b];
  const auto [c, d, e] = face;
  using enum ContactKind;
  return rest.near(kVertexFace, {a, c, d, e}) || rest.near(kVertexFace, {b, c, d, e}) ||
         rest.near(kEdgeEdge, {a, b, c, d}) || rest.near(kEdgeEdge, {a, b, d, e}) ||
         rest.near(kEdgeEdge, {a, b, e, c}) || rest.meet({a, b}, face);
}

}  // namespace warmfront
