// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/orphans.h"

#include <algorithm>
#include <string>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/adjacency.h"

namespace warmfront {
namespace {

bool is_orphan_vf(const Scene& scene, std::uint32_t v, const Face& face) {
  return std::ranges::all_of(scene.vertex_faces()[v],
                             [&](std::uint32_t g) { return adjacent(scene.faces()[g], face); });
}

bool is_orphan_lone(const Scene& scene, EdgeId lone, EdgeId e) {
  return !share_vertex(ends_of(scene, lone), ends_of(scene, e)) &&
         std::ranges::all_of(faces_along(scene, e), [&](std::uint32_t g) {
           return adjacent(ends_of(scene, lone), scene.faces()[g]);
         });
}

bool is_orphan_ee(const Scene& scene, EdgeId e1, EdgeId e2) {
  return std::ranges::all_of(faces_along(scene, e1), [&](std::uint32_t g) {
    return std::ranges::all_of(faces_along(scene, e2),
                               [&](std::uint32_t h) { return adjacent(scene.faces()[g], scene.faces()[h]); });
  });
}

}  // namespace

Status check_hubs(const Scene& scene, StopSignal stop, std::uint32_t* worst) {
  PacedStop paced(stop);
  std::uint64_t adjacencies = 0;
  std::uint64_t corners = 0;
  std::uint64_t ends = 0;
  std::uint64_t greatest = 0;
  std::uint32_t hub = 0;
  const auto count = [&](std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t v = first; v < end; ++v) {
      paced.check();
      const std::uint64_t faces = scene.vertex_faces()[v].size();
      const std::uint64_t degree = faces + scene.lone_edges_of(v).size();
      adjacencies += degree * degree;
      corners += faces;
      ends += degree - faces;
      if (degree > greatest) {
        greatest = degree;
        hub = v;
      }
    }
  };
  if (scene.bodies().empty()) count(0, scene.vertex_count());
  for (const Body& body : scene.bodies()) {
    paced.check();
    if (body.kind == BodyKind::kDeformable && body.self_collision)
      count(body.first_vertex, body.first_vertex + body.vertex_count);
  }
  const std::uint64_t most = std::max(kMostAdjacencies, kMostAdjacenciesAFace * (corners / 3 + ends / 2));
  if (adjacencies < most) return {};
  if (worst != nullptr) *worst = hub;
  const std::string elements = ends > 0 ? " faces and edges" : " faces";
  return Error{ErrorCode::kResourceExhausted,
               "faces: " + std::to_string(adjacencies) + " pairs of" + elements +
                   " share a vertex of bodies that are tested against themselves, more than " +
                   std::to_string(most) + "; vertex " + std::to_string(hub) + " alone is in " +
                   std::to_string(greatest) + elements +
                   ": split it, or switch its body's self_collision off"};
}

namespace {

// Of a vertex of no face: the first lone edge around it tests it against all faces but those at its other
// end.
void orphans_of_end(const Scene& scene, std::uint32_t v, std::vector<VertexFaceIds>& found) {
  const auto around = lone_edges_of(scene, v);
  if (around.empty()) return;
  const Edge& first = ends_of(scene, around.front());
  for (const std::uint32_t f : scene.vertex_faces()[first[0] == v ? first[1] : first[0]])
    found.push_back({NewVertex{v}, NewFace{f}});
}

// Only faces that share a vertex with the first face around v, and do not contain v, can be adjacent to all.
void orphans_of_vertex(const Scene& scene, std::uint32_t v, std::vector<VertexFaceIds>& found) {
  const auto around = scene.vertex_faces()[v];
  if (around.empty()) return orphans_of_end(scene, v, found);
  const Face& first = scene.faces()[around.front()];
  const int corner = first[0] == v ? 0 : first[1] == v ? 1 : 2;
  const std::uint32_t next = first[(corner + 1) % 3];
  const std::uint32_t last = first[(corner + 2) % 3];
  const auto consider_around = [&](std::uint32_t neighbour, bool is_last) {
    for (const std::uint32_t f : scene.vertex_faces()[neighbour]) {
      const Face& face = scene.faces()[f];
      if (has_vertex(face, v) || (is_last && has_vertex(face, next))) continue;
      if (is_orphan_vf(scene, v, face)) found.push_back({NewVertex{v}, NewFace{f}});
    }
  };
  consider_around(next, false);
  consider_around(last, true);
}

// The first face along an orphan's other edge has its opposite corner at the lone edge. Of edges that both
// lone and other ones have, the lesser finds the pair.
void orphans_of_lone_edge(const Scene& scene, EdgeId lone, std::vector<EdgeEdgeIds>& found) {
  for (const std::uint32_t v : ends_of(scene, lone)) {
    for (const std::uint32_t h : scene.vertex_faces()[v]) {
      for (const EdgeId e : sides_of(scene, h))
        if (lone < e && is_orphan_lone(scene, lone, e)) found.push_back({lone, e});
    }
  }
}

// The same from the other edge, of a face whose corner off the edge is `opposite`.
void lone_edges_at(const Scene& scene, EdgeId e, std::uint32_t opposite, std::vector<EdgeEdgeIds>& found) {
  for (const EdgeId lone : lone_edges_of(scene, opposite))
    if (e < lone && is_orphan_lone(scene, lone, e)) found.push_back({e, lone});
}

// As orphans_of_vertex(): the first face along an orphan's other edge contains a, b or c of the first face
// (a, b, c) along this edge, (a, b); not both a and b, or the edges would share a vertex. Faces that repeat
// an index give some pairs twice: gather() removes duplicates.
void orphans_of_edge(const Scene& scene, EdgeId e1, std::vector<EdgeEdgeIds>& found) {
  const auto along = faces_along(scene, e1);
  if (along.empty()) return orphans_of_lone_edge(scene, e1, found);
  const auto [a, b] = ends_of(scene, e1);
  const Face& first = scene.faces()[along.front()];
  for (const std::uint32_t corner : first)
    if (corner != a && corner != b) lone_edges_at(scene, e1, corner, found);
  const Face& second = scene.faces()[along.back()];
  const auto consider = [&](std::uint32_t h, EdgeId e2) {
    if (e1 < e2 && faces_along(scene, e2).front() == h &&
        !share_vertex(ends_of(scene, e1), ends_of(scene, e2)) && is_orphan_ee(scene, e1, e2))
      found.push_back({e1, e2});
  };
  for (const std::uint32_t corner : first) {
    for (const std::uint32_t h : scene.vertex_faces()[corner]) {
      const Face& face = scene.faces()[h];
      const bool has_a = has_vertex(face, a);
      const bool has_b = has_vertex(face, b);
      if (a != b && has_a && has_b) continue;
      if (corner != a && corner != b) {
        if (has_a || has_b || !adjacent(face, second)) continue;  // found at that corner; or not an orphan
        for (const EdgeId e2 : sides_of(scene, h)) consider(h, e2);
      } else {
        const int at = face[0] == corner ? 0 : face[1] == corner ? 1 : 2;
        consider(h, side_of(scene, h, (at + 1) % 3));  // the edge opposite the corner
      }
    }
  }
}

// Such a face contains the vertex of the first face along the edge that is not the edge's.
void faces_of_edge(const Scene& scene, EdgeId e, std::vector<EdgeFaceIds>& found) {
  const Edge& edge = ends_of(scene, e);
  const auto along = faces_along(scene, e);
  if (along.empty()) return;  // what a lone edge is adjacent to shares a vertex
  const Face& first = scene.faces()[along.front()];
  const auto of_edge = [&](std::uint32_t v) { return v == edge[0] || v == edge[1]; };
  const auto opposite = std::ranges::find_if_not(first, of_edge);
  if (opposite == first.end())
    return;  // a face that repeats an index: what it is adjacent to shares a vertex
  for (const std::uint32_t f : scene.vertex_faces()[*opposite]) {
    const Face& face = scene.faces()[f];
    if (has_vertex(face, edge[0]) || has_vertex(face, edge[1])) continue;
    if (std::ranges::all_of(along, [&](std::uint32_t h) { return adjacent(scene.faces()[h], face); }))
      found.push_back({e, NewFace{f}});
  }
}

// Runs `of_each` for all first features of a range and returns the results, sorted, without duplicates. Works
// range by range, so that the peak memory is little more than the result.
template <class Ids, class OfEach>
std::vector<Ids> gather(decltype(Ids::a) first, decltype(Ids::a) end, StopSignal stop, OfEach&& of_each) {
  constexpr std::uint32_t kIds = 2048;
  constexpr std::uint32_t kRanges = 64;
  const std::uint64_t last = number_of(end);
  std::vector<Ids> all;
  std::vector<std::vector<Ids>> found(kRanges);
  for (std::uint64_t begin = number_of(first); begin < last; begin += std::uint64_t{kIds} * kRanges) {
    fork_each(std::uint32_t{0}, kRanges, [&](std::uint32_t range) {
      const std::uint64_t from = std::min<std::uint64_t>(begin + std::uint64_t{range} * kIds, last);
      const std::uint64_t to = std::min<std::uint64_t>(from + kIds, last);
      std::vector<Ids>& ours = found[range];
      for (std::uint64_t id = from; id < to; ++id) {
        if (id % 16 == 0) stop.check();
        const auto before = static_cast<std::ptrdiff_t>(ours.size());
        of_each(decltype(Ids::a){static_cast<std::uint32_t>(id)}, ours);
        std::sort(ours.begin() + before, ours.end());
        ours.erase(std::unique(ours.begin() + before, ours.end()), ours.end());
      }
    });
    for (auto& some : found) {
      stop.check();
      all.insert(all.end(), some.begin(), some.end());
      std::vector<Ids>().swap(some);
    }
  }
  stop.check();
  all.shrink_to_fit();
  return all;
}

}  // namespace

std::vector<EdgeFaceIds> edge_face_orphans(const Scene& scene, const FeatureRange& range, StopSignal stop) {
  return gather<EdgeFaceIds>(range.first_edge, range.end_edge, stop,
                             [&](EdgeId e, auto& found) { faces_of_edge(scene, e, found); });
}

Orphans enumerate_orphans(const Scene& scene, const FeatureRange& range, StopSignal stop) {
  return {
      gather<VertexFaceIds>(NewVertex{range.first_vertex}, NewVertex{range.end_vertex}, stop,
                            [&](NewVertex v, auto& found) { orphans_of_vertex(scene, number_of(v), found); }),
      gather<EdgeEdgeIds>(range.first_edge, range.end_edge, stop,
                          [&](EdgeId e, auto& found) { orphans_of_edge(scene, e, found); })};
}

namespace {

// Rows of `before` are of features that ascend; those of each that is not near the change are taken over: it
// was what `before_of` says, and the others are now what `renumbered` says.
template <class A, class B, class IsNear, class OfEach, class BeforeOf, class Renumbered>
std::vector<FeatureIds<A, B>> follow(const std::vector<FeatureIds<A, B>>& before, std::uint32_t count,
                                     StopSignal stop, IsNear&& is_near, OfEach&& of_each,
                                     BeforeOf&& before_of, Renumbered&& renumbered) {
  PacedStop paced(stop, 64);
  std::vector<FeatureIds<A, B>> all;
  reserve(all, before.size() + before.size() / 16, stop);
  std::vector<FeatureIds<A, B>> found;
  std::size_t at = 0;
  for (A id{0}; id < A{count}; ++id) {
    paced.check();
    found.clear();
    if (is_near(id)) {
      of_each(id, found);
    } else {
      const A old = before_of(id);
      while (at < before.size() && before[at].a < old) {
        paced.check();
        ++at;
      }
      for (; at < before.size() && before[at].a == old; ++at) found.push_back({id, renumbered(before[at].b)});
    }
    std::ranges::sort(found);
    found.erase(std::unique(found.begin(), found.end()), found.end());
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

}  // namespace

// The faces around a vertex change where it is of one that went or came, and of these the orphans of a vertex
// are that share one with its first face. Those of an edge depend on the faces along it, on those around
// their vertices, and on all along the sides of these: at an edge of which both ends are far, these are as
// they were.
Orphans enumerate_orphans(const Scene& scene, const Orphans& before, const MeshRange& part,
                          const LocalChange& change, StopSignal stop) {
  using Near = LocalChange::Near;
  Orphans orphans;
  const auto near = [&](NewVertex v) { return change.near[number_of(v)]; };
  orphans.vertex_face = follow(
      before.vertex_face, scene.vertex_count(), stop,
      [&](NewVertex v) { return near(v) == Near::kAt || near(v) == Near::kBeside; },
      [&](NewVertex v, auto& found) { orphans_of_vertex(scene, number_of(v), found); },
      [&](NewVertex v) { return v + part.features.first_vertex; },
      [&](NewFace f) { return NewFace{change.face_of[f - NewFace{part.first_face}]}; });
  orphans.edge_edge = follow(
      before.edge_edge, scene.edge_count(), stop,
      [&](EdgeId e) {
        return std::ranges::any_of(ends_of(scene, e),
                                   [&](std::uint32_t v) { return change.near[v] != Near::kFar; });
      },
      [&](EdgeId e, auto& found) { orphans_of_edge(scene, e, found); },
      [&](EdgeId e) { return part.features.first_edge + number_of(change.edge_before[number_of(e)]); },
      [&](EdgeId e) { return change.edge_of[e - part.features.first_edge]; });
  stop.check();
  orphans.vertex_face.shrink_to_fit();
  orphans.edge_edge.shrink_to_fit();
  return orphans;
}

}  // namespace warmfront
