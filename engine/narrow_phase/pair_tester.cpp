// SPDX-License-Identifier: Apache-2.0
// From pairs of primitives to blocks of feature pairs. Their tests are in feature_tests.cpp, what becomes of
// contacts is in contact_reports.cpp.
#include "engine/narrow_phase/pair_tester.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "engine/bounds/overlap.h"
#include "engine/elementary/certified.h"
#include "engine/narrow_phase/rest_filter.h"
#include "engine/scene/primitives.h"

namespace warmfront {
namespace {

FeaturePair vertex_face(const Scene& scene, std::uint32_t v, std::uint32_t f) {
  const Face& face = scene.faces()[f];
  return {{v, face[0], face[1], face[2]}, v, f, ContactKind::kVertexFace};
}

// The lesser edge first.
FeaturePair edge_edge(const Scene& scene, EdgeId e1, EdgeId e2) {
  const EdgeId lesser = std::min(e1, e2);
  const EdgeId greater = std::max(e1, e2);
  const Edge& a = ends_of(scene, lesser);
  const Edge& b = ends_of(scene, greater);
  return {{a[0], a[1], b[0], b[1]}, number_of(lesser), number_of(greater), ContactKind::kEdgeEdge};
}

}  // namespace

void PairTester::begin(const NarrowPhaseInput& input, NarrowPhaseShared& shared) {
  input_ = &input;
  shared_ = &shared;
  contacts_.clear();
  output_ = {};
  clock_.take();
  block_.size = 0;
  element_pairs_ = 0;
  recorder_ = nullptr;
  most_kept_ = input.options.max_contacts;
  if (input.note_met) met_.clear();
}

void PairTester::met_pair(Primitive p, Primitive q) {
  if (!has_point(p, q)) {
    const Face of_p = primitive_vertices(input_->scene, p);
    const Face of_q = primitive_vertices(input_->scene, q);
    if (!overlap<KDop18>(bounds_of(of_p), bounds_of(of_q), width_of(of_p, of_q))) return;
  }
  primitive_pair(p, q);
}

void PairTester::primitive_pair(Primitive p, Primitive q, std::uint32_t near) {
  std::uint32_t left_out = 0;
  if (input_->filter.any() && are_faces(p, q)) {
    // As element_pair() orders them.
    left_out = input_->filter.left_out(input_->scene.faces()[face_number(std::min(p, q))],
                                       input_->scene.faces()[face_number(std::max(p, q))]);
    if (left_out == PairFilter::kAll) {
      ++output_.counts.triangle_pairs_filtered;
      return;
    }
  }
  const bool of_points = !is_face(p) && !is_face(q) && has_point(p, q);
  if (of_points && !knows_distances()) return;
  // Also what this question does not ask about: another one, part of the same way, may.
  if (input_->note_met && room_to_note(1)) met_.pairs.push_back({p, q});
  if (!has_point(p, q)) {
    element_pair(std::min(p, q), std::max(p, q), left_out, near);
  } else if (input_->options.pair_test == PairTest::kIntersection) {
    return;  // a point has no edge
  } else if (of_points) {
    point_pair(p, q);
  } else if (is_face(p)) {
    vertex_against_face(vertex_number(q), face_number(p));
  } else {
    vertex_against_face(vertex_number(p), face_number(q));
  }
}

bool PairTester::knows_distances() const {
  // Also for who asks about part of the way afterwards: up to the widest separation all that meets is noted.
  return input_->options.min_separation > 0 || input_->keep.share > 0 || input_->thickness.any();
}

void PairTester::point_pair(Primitive p, Primitive q) {
  if (is_segment(p)) std::swap(p, q);
  const std::uint32_t v = vertex_number(p);
  FeaturePair pair;
  if (is_segment(q)) {
    const EdgeId edge = edge_id(q);
    const auto [a, b] = ends_of(input_->scene, edge);
    pair = {{v, v, a, b}, v, number_of(edge), ContactKind::kVertexEdge};
  } else {
    const std::uint32_t other = vertex_number(q);
    // In the order of given numbers, so that the test's roundings are the same however vertices are numbered.
    const auto given = [this](std::uint32_t w) { return number_of(input_->numbering.given(NewVertex{w})); };
    const auto [a, b] = given(v) < given(other) ? std::pair(v, other) : std::pair(other, v);
    pair = {{a, a, b, b}, a, b, ContactKind::kVertexVertex};
  }
  const auto& [a, ignored, b, c] = pair.vertices;
  if (input_->keep.share == 0 && separation(pair) == 0) return;
  if (overlap<KDop18>(bounds_of(a, a, a), bounds_of(b, c, c), width_of({&a, 1}, {&b, 1}))) push(pair);
}

// A face before a segment.
void PairTester::element_pair(Primitive p, Primitive q, std::uint32_t left_out, std::uint32_t near) {
  if (are_faces(p, q)) {
    const std::uint32_t patch = input_->patches.of_face[face_number(p)];
    if (patch != Patches::kNone && patch == input_->patches.of_face[face_number(q)] &&
        input_->patch_culled[patch] != 0) {
      ++output_.counts.cone_culled_pairs;
      return;
    }
  }
  ++output_.counts.triangle_pairs;
  const Face of_p = primitive_vertices(input_->scene, p);
  const Face of_q = primitive_vertices(input_->scene, q);
  elements_[element_pairs_] = {p, q, left_out, near};
  for (int k = 0; k < 3; ++k) {
    corners_.vertex[k][element_pairs_] = of_p[k];
    corners_.vertex[k + 3][element_pairs_] = of_q[k];
  }
  corners_.width[element_pairs_] = width_between(of_p, of_q).straight;
  if (++element_pairs_ == elements_.size()) filter_elements();
}

void PairTester::filter_elements() {
  const std::size_t count = std::exchange(element_pairs_, 0);
  if (count == 0) return;
  for (auto& corner : corners_.vertex) std::fill(corner.begin() + count, corner.end(), corner[0]);
  for (std::uint32_t bits = ~elements_apart() & ((1U << count) - 1); bits != 0; bits &= bits - 1) {
    const auto [p, q, left_out, near] = elements_[static_cast<std::size_t>(std::countr_zero(bits))];
    if (input_->options.pair_test == PairTest::kIntersection)
      edge_face_pairs(p, q);
    else if (is_segment(q))
      segment_pairs(p, q);
    else
      feature_pairs(face_number(p), face_number(q), left_out, near);
  }
}

// Bit i is set where pair i of those taken has no contact that is asked for.
std::uint32_t PairTester::elements_apart() {
  const ColliderOptions& options = input_->options;
  if (options.report == Report::kCandidates) return 0;
  const double reach = certified_reach(options.tolerance);
  // Of a time between, the fast tier may report a pair at one when it is apart.
  if (asks_for_earliest() && options.tier != Tier::kFast) {
    if (input_->worlds.any() || input_->arcs.any()) {
      for (std::size_t i = 0; i < corners_.until.size(); ++i)
        corners_.until[i] = until_of(corners_.vertex[0][i], corners_.vertex[3][i]);
    } else {
      corners_.until.fill(until_of(corners_.vertex[0][0], corners_.vertex[3][0]));
    }
    if (std::ranges::min(corners_.until) < 1)
      return triangles_apart_until(corners_, input_->vertex_bounds, reach);
  }
  return triangles_apart(corners_, input_->vertex_bounds, reach);
}

void PairTester::edge_face_pairs(Primitive p, Primitive q) {
  const Scene& scene = input_->scene;
  if (is_segment(q)) {
    if (is_face(p)) edge_against_face(edge_id(q), face_number(p));
    return;
  }
  const std::uint32_t f = face_number(p);
  const std::uint32_t g = face_number(q);
  for (int i = 0; i < 3; ++i) {
    if (input_->ownership.owns_edge_face(f, i, g)) edge_against_face(side_of(scene, f, i), g);
    if (input_->ownership.owns_edge_face(g, i, f)) edge_against_face(side_of(scene, g, i), f);
  }
}

void PairTester::edge_against_face(EdgeId e, std::uint32_t f) {
  const Edge& edge = ends_of(input_->scene, e);
  const Face& face = input_->scene.faces()[f];
  if (overlap<KDop18>(bounds_of(edge), bounds_of(face), width_of(edge, face)))
    push({{edge[0], edge[1], face[0], face[1]}, number_of(e), f, ContactKind::kEdgeFace});
}

float PairTester::until_of(std::uint32_t p, std::uint32_t q) const {
  const bool turning = input_->arcs.around(p) != nullptr || input_->arcs.around(q) != nullptr;
  return asks_for_earliest() && !turning ? std::min(until_in(world_around(p, q)), 1.0F) : 1;
}

std::uint32_t PairTester::overlapping(const Face& p, const Face& q, std::uint32_t wanted) const {
  const float latest = until_of(p[0], q[0]);
  const Width width = width_between(p, q);
  return latest < 1 ? overlapping_features(bounds_of(p), bounds_of(q), wanted, latest, width)
                    : overlapping_features(bounds_of(p), bounds_of(q), wanted, width);
}

void PairTester::segment_pairs(Primitive p, Primitive segment) {
  const Scene& scene = input_->scene;
  const EdgeId edge = edge_id(segment);
  const std::uint32_t owned = input_->ownership.owned_with_segment(p, edge);
  if (owned == 0) return;
  for (std::uint32_t bits =
           overlapping(primitive_vertices(scene, p), primitive_vertices(scene, segment), owned);
       bits != 0; bits &= bits - 1) {
    const int feature = std::countr_zero(bits);
    if (feature < 6) {
      push(vertex_face(scene, ends_of(scene, edge)[feature - 3], face_number(p)));
    } else {
      const EdgeId other = is_face(p) ? side_of(scene, face_number(p), (feature - 6) / 3) : edge_id(p);
      push(edge_edge(scene, edge, other));
    }
  }
}

void PairTester::feature_pairs(std::uint32_t f, std::uint32_t g, std::uint32_t left_out, std::uint32_t near) {
  const Scene& scene = input_->scene;
  const Face& face_f = scene.faces()[f];
  const Face& face_g = scene.faces()[g];
  // Ownership of a near pair's features is expensive: query it only where the features' moving bounds
  // overlap.
  const auto [owned, perhaps] = input_->ownership.candidates(f, g);
  const std::uint32_t wanted = (owned | perhaps) & near;
  if (wanted == 0) return;
  std::uint32_t bits = overlapping(face_f, face_g, wanted);
  for (; bits != 0; bits &= bits - 1) {
    const int feature = std::countr_zero(bits);
    if ((bits & -bits & perhaps) != 0 && !input_->ownership.owns(f, g, feature)) continue;
    if ((bits & -bits & left_out) != 0) {
      ++output_.counts.feature_pairs_filtered;
    } else if (feature < 3) {
      push_unless_at_rest(vertex_face(scene, face_f[feature], g));
    } else if (feature < 6) {
      push_unless_at_rest(vertex_face(scene, face_g[feature - 3], f));
    } else {
      push_unless_at_rest(
          edge_edge(scene, side_of(scene, f, (feature - 6) / 3), side_of(scene, g, (feature - 6) % 3)));
    }
  }
}

Width PairTester::width_of(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) const {
  return input_->widths.around(a[0], b[0]);
}

Width PairTester::width_between(const Face& p, const Face& q) const {
  const Width width = width_of(p, q);
  if (input_->keep.share == 0 || input_->arcs.any()) return width;
  const auto corners = [this](const Face& of) -> Corners {
    return {input_->vertices[of[0]].t0, input_->vertices[of[1]].t0, input_->vertices[of[2]].t0};
  };
  double beyond = input_->kept_beyond;
  if (input_->thickness.any())
    beyond = separation_of(beyond, input_->thickness.of(p), input_->thickness.of(q));
  const KeepDistance keep{input_->keep.share, beyond};
  return input_->widths.narrowed(keep.of_distance(farthest_features(corners(p), corners(q))), width);
}

std::pair<double, double> PairTester::thickness_of(const FeaturePair& pair) const {
  const std::span<const std::uint32_t> vertices(pair.vertices);
  const std::size_t of_a = vertices_of_first(pair.kind);
  return {input_->thickness.of(vertices.first(of_a)), input_->thickness.of(vertices.subspan(of_a))};
}

double PairTester::separation(const FeaturePair& pair, double asked) const {
  if (!input_->thickness.any()) return asked;
  const auto [a, b] = thickness_of(pair);
  return separation_of(asked, a, b);
}

float PairTester::until_in(std::uint32_t world) const {
  return std::nextafter(static_cast<float>(shared_->earliest.of(world)), 2.0F);
}

std::uint32_t PairTester::world_around(std::uint32_t vertex_a, std::uint32_t vertex_b) const {
  if (!input_->worlds.any()) return 0;
  return world_of_bodies(vertex_a, input_->scene.body_of_vertex()[vertex_b]);
}

std::uint32_t PairTester::world_of_bodies(std::uint32_t vertex, std::uint32_t body) const {
  if (!input_->worlds.any()) return 0;
  return input_->worlds.place(input_->scene.body_of_vertex()[vertex], body);
}

double PairTester::earliest_around(const FeaturePair& pair) const {
  return shared_->earliest.of(world_around(pair.vertices.front(), pair.vertices.back()));
}

TriangleBounds PairTester::bounds_of(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const auto& of = input_->vertex_bounds;
  return {{&of[a], &of[b], &of[c]}};
}

void PairTester::vertex_against_face(std::uint32_t v, std::uint32_t f) {
  const Face& face = input_->scene.faces()[f];
  if (overlap<KDop18>(bounds_of(v, v, v), bounds_of(face), width_of({&v, 1}, face)))
    push(vertex_face(input_->scene, v, f));
}

void PairTester::orphan(VertexFaceIds ids) {
  ++output_.counts.orphan_tests;
  vertex_against_face(number_of(ids.a), number_of(ids.b));
}

void PairTester::orphan(EdgeFaceIds ids) {
  ++output_.counts.orphan_tests;
  edge_against_face(ids.a, number_of(ids.b));
}

void PairTester::orphan(EdgeEdgeIds ids) {
  ++output_.counts.orphan_tests;
  const Edge& a = ends_of(input_->scene, ids.a);
  const Edge& b = ends_of(input_->scene, ids.b);
  if (overlap<KDop18>(bounds_of(a), bounds_of(b), width_of(a, b)))
    push(edge_edge(input_->scene, ids.a, ids.b));
}

void PairTester::push(const FeaturePair& pair) {
  if (input_->filter.any()) {
    const std::span<const std::uint32_t> vertices(pair.vertices);
    const std::size_t of_a = vertices_of_first(pair.kind);
    std::span<const std::uint32_t> of_b = vertices.subspan(of_a);
    if (pair.kind == ContactKind::kEdgeFace) of_b = input_->scene.faces()[pair.b];
    if (input_->filter.leaves_out(vertices.first(of_a), of_b)) {
      ++output_.counts.feature_pairs_filtered;
      return;
    }
  }
  push_unless_at_rest(pair);
}

void PairTester::push_unless_at_rest(const FeaturePair& pair) {
  // Of the others test_features() looks at a block.
  if (pair.kind == ContactKind::kEdgeFace && input_->filter.rest_distance() > 0 &&
      is_near_at_rest(input_->filter, input_->scene, pair)) {
    ++output_.counts.feature_pairs_filtered;
    return;
  }
  block_.push(pair);
  if (block_.full()) test_features(block_);
}

void PairTester::flush() {
  filter_elements();
  test_features(block_);
}

}  // namespace warmfront
