// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/orphans.h"

#include <algorithm>
#include <functional>

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

// Which orphans of an edge are looked for. Each of two edges finds their pair.
enum class With : std::uint8_t { kGreater, kAll };

EdgeEdgeIds in_order(EdgeId e1, EdgeId e2) {
  return {std::min(e1, e2), std::max(e1, e2)};
}

// The first face along an orphan's other edge has its opposite corner at the lone edge.
template <With kWith>
void orphans_of_lone_edge(const Scene& scene, EdgeId lone, std::vector<EdgeEdgeIds>& found) {
  for (const std::uint32_t v : ends_of(scene, lone)) {
    for (const std::uint32_t h : scene.vertex_faces()[v]) {
      for (const EdgeId e : sides_of(scene, h))
        if ((kWith == With::kAll || lone < e) && is_orphan_lone(scene, lone, e))
          found.push_back(in_order(lone, e));
    }
  }
}

// The same from the other edge, of a face whose corner off the edge is `opposite`.
template <With kWith>
void lone_edges_at(const Scene& scene, EdgeId e, std::uint32_t opposite, std::vector<EdgeEdgeIds>& found) {
  for (const EdgeId lone : lone_edges_of(scene, opposite))
    if ((kWith == With::kAll || e < lone) && is_orphan_lone(scene, lone, e))
      found.push_back(in_order(e, lone));
}

// The corner of a face that is not at its edge (a, b).
std::uint32_t corner_off(const Face& face, std::uint32_t a, std::uint32_t b) {
  return face[0] + face[1] + face[2] - a - b;
}

// As orphans_of_vertex(): the first face along an orphan's other edge contains a, b or c of the first face
// (a, b, c) along this edge, (a, b); not both a and b, or the edges would share a vertex. Faces that repeat
// an index give some pairs twice: gather() removes duplicates.
template <With kWith>
void orphans_of_edge(const Scene& scene, EdgeId e1, std::vector<EdgeEdgeIds>& found) {
  const auto along = faces_along(scene, e1);
  if (along.empty()) return orphans_of_lone_edge<kWith>(scene, e1, found);
  const Edge& ends = ends_of(scene, e1);
  const std::uint32_t a = ends[0];
  const std::uint32_t b = ends[1];
  const Face& first = scene.faces()[along.front()];
  for (const std::uint32_t corner : first)
    if (corner != a && corner != b) lone_edges_at<kWith>(scene, e1, corner, found);
  const std::uint32_t c = corner_off(first, a, b);
  const std::uint32_t d = corner_off(scene.faces()[along.back()], a, b);
  const auto consider = [&](std::uint32_t h, EdgeId e2) {
    if ((kWith == With::kAll || e1 < e2) && faces_along(scene, e2).front() == h &&
        !share_vertex(ends, ends_of(scene, e2)) && is_orphan_ee(scene, e1, e2))
      found.push_back(in_order(e1, e2));
  };
  // Is another face along a side (p, q), of a face h at a or b, adjacent to those along (a, b)? Nearly never,
  // so it is asked first, and without a branch.
  const auto other_face_is_near = [&](std::uint32_t h, EdgeId e2, std::uint32_t p, std::uint32_t q) {
    const auto along_e2 = faces_along(scene, e2);
    const std::uint32_t is_first = along_e2.front() == h ? ~0U : 0;
    const std::uint32_t g = along_e2.front() ^ ((along_e2.front() ^ along_e2.back()) & is_first);
    const std::uint32_t r = corner_off(scene.faces()[g], p, q);
    const bool has_c = (p == c) | (q == c) | (r == c);
    const bool has_d = (p == d) | (q == d) | (r == d);
    return static_cast<bool>((r == a) | (r == b) | (has_c & has_d));
  };
  for (const std::uint32_t corner : first) {
    for (const std::uint32_t h : scene.vertex_faces()[corner]) {
      const Face& face = scene.faces()[h];
      if (corner != a && corner != b) {
        if (!has_vertex(face, d)) continue;                        // not an orphan
        if (has_vertex(face, a) || has_vertex(face, b)) continue;  // found at that corner
        for (const EdgeId e2 : sides_of(scene, h)) consider(h, e2);
      } else {
        const int at = face[0] == corner ? 0 : face[1] == corner ? 1 : 2;
        const EdgeId e2 = side_of(scene, h, (at + 1) % 3);  // the edge opposite the corner
        if (kWith == With::kGreater && e2 < e1) continue;   // found from there
        if (!other_face_is_near(h, e2, face[(at + 1) % 3], face[(at + 2) % 3])) continue;
        if (a != b && has_vertex(face, a) && has_vertex(face, b)) continue;
        consider(h, e2);
      }
    }
  }
}

// Of the edges that begin here: each edge by its first face, each face by its first corner. Neighbours in
// space are then looked at one after the other, which edges in the order of their numbers need not be.
void orphans_of_edges_at(const Scene& scene, std::uint32_t v, std::vector<EdgeEdgeIds>& found) {
  for (const EdgeId e : lone_edges_of(scene, v))
    if (ends_of(scene, e)[0] == v) orphans_of_edge<With::kGreater>(scene, e, found);
  for (const std::uint32_t f : scene.vertex_faces()[v]) {
    if (scene.faces()[f][0] != v) continue;
    for (const EdgeId e : sides_of(scene, f))
      if (faces_along(scene, e).front() == f) orphans_of_edge<With::kGreater>(scene, e, found);
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

template <class Ids>
void sort_once_each(std::vector<Ids>& ids, StopSignal stop) {
  sort_in_parallel(ids, stop, std::less<>());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

// Runs `of_each` for all features of a range, in their order, and returns the results, those of each sorted
// and without duplicates. Works range by range, so that the peak memory is little more than the result.
template <class Ids, class First, class OfEach>
std::vector<Ids> gather(First first, First end, StopSignal stop, OfEach&& of_each) {
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
        of_each(First{static_cast<std::uint32_t>(id)}, ours);
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
  const NewVertex first{range.first_vertex};
  const NewVertex end{range.end_vertex};
  Orphans orphans{
      gather<VertexFaceIds>(first, end, stop,
                            [&](NewVertex v, auto& found) { orphans_of_vertex(scene, number_of(v), found); }),
      gather<EdgeEdgeIds>(first, end, stop, [&](NewVertex v, auto& found) {
        orphans_of_edges_at(scene, number_of(v), found);
      })};
  sort_once_each(orphans.edge_edge, stop);
  return orphans;
}

namespace {

constexpr std::uint32_t kNone = LocalChange::kNone;
constexpr EdgeId kNoEdge = LocalChange::kNoEdge;

// Merges `made` with those of `before` that `stays` takes over, of which both ascend.
template <class Ids, class Stays>
std::vector<Ids> follow(const std::vector<Ids>& before, const std::vector<Ids>& made, StopSignal stop,
                        Stays&& stays) {
  std::vector<Ids> all;
  reserve(all, before.size() + made.size(), stop);
  auto next = made.begin();
  in_pieces(0, before.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
      Ids pair;
      if (!stays(before[i], pair)) continue;
      while (next != made.end() && *next < pair) all.push_back(*next++);
      all.push_back(pair);
    }
  });
  all.insert(all.end(), next, made.end());
  return all;
}

// Vertices of which any orphan may be another one: those of what changed, and, where a vertex is of no face,
// that at the other end of its first lone edge.
std::vector<std::uint32_t> vertices_to_find(const Scene& scene, const LocalChange& change, StopSignal stop) {
  std::vector<std::uint32_t> vertices = change.at;
  for (const std::uint32_t v : change.at) {
    for (const EdgeId e : lone_edges_of(scene, v)) {
      for (const std::uint32_t w : ends_of(scene, e))
        if (scene.vertex_faces()[w].empty()) vertices.push_back(w);
    }
  }
  sort_once_each(vertices, stop);
  return vertices;
}

std::vector<VertexFaceIds> follow_vertices(const Scene& scene, const Orphans& before, const MeshRange& part,
                                           const LocalChange& change, StopSignal stop) {
  PacedStop paced(stop, 16);
  std::vector<VertexFaceIds> made;
  const std::vector<std::uint32_t> vertices = vertices_to_find(scene, change, stop);
  std::vector<std::uint8_t> found;
  lengthen(found, scene.vertex_count(), std::uint8_t{0}, stop);
  for (const std::uint32_t v : vertices) {
    paced.check();
    found[v] = 1;
    orphans_of_vertex(scene, v, made);
  }
  // Of others, with a face that came: each face around such a vertex has one of its vertices.
  for (const std::uint32_t f : change.came) {
    const Face& face = scene.faces()[f];
    for (const std::uint32_t u : face) {
      for (const std::uint32_t g : scene.vertex_faces()[u]) {
        paced.check();
        for (const std::uint32_t v : scene.faces()[g])
          if (found[v] == 0 && is_orphan_vf(scene, v, face)) made.push_back({NewVertex{v}, NewFace{f}});
      }
    }
  }
  sort_once_each(made, stop);
  const NewVertex first_vertex{part.features.first_vertex};
  const NewFace first_face{part.first_face};
  const auto stays = [&](const VertexFaceIds& pair, VertexFaceIds& now) {
    const std::uint32_t v = pair.a - first_vertex;
    const std::uint32_t f = change.face_of[pair.b - first_face];
    now = {NewVertex{v}, NewFace{f}};
    return f != kNone && found[v] == 0;
  };
  if (change.faces_ascend) return follow(before.vertex_face, made, stop, stays);
  std::vector<VertexFaceIds> all;
  reserve(all, before.vertex_face.size() + made.size(), stop);
  for (const VertexFaceIds& pair : before.vertex_face) {
    paced.check();
    VertexFaceIds now;
    if (stays(pair, now)) all.push_back(now);
  }
  append(all, std::span<const VertexFaceIds>(made), stop);
  sort_in_parallel(all, stop, std::less<>());
  return all;
}

std::vector<EdgeEdgeIds> follow_edges(const Scene& scene, const Orphans& before, const MeshRange& part,
                                      const LocalChange& change, StopSignal stop) {
  PacedStop paced(stop, 16);
  std::vector<EdgeEdgeIds> made;
  std::vector<EdgeId> edge_of;  // of those that did not change
  append(edge_of, std::span<const EdgeId>(change.edge_of), stop);
  for (const LocalChange::Touched& edge : change.touched) {
    paced.check();
    if (!edge.changed()) continue;
    if (edge.before != kNoEdge) edge_of[number_of(edge.before)] = kNoEdge;
    if (edge.now != kNoEdge) orphans_of_edge<With::kAll>(scene, edge.now, made);
  }
  sort_once_each(made, stop);
  const EdgeId first = part.features.first_edge;
  return follow(before.edge_edge, made, stop, [&](const EdgeEdgeIds& pair, EdgeEdgeIds& now) {
    now = {edge_of[pair.a - first], edge_of[pair.b - first]};
    return now.a != kNoEdge && now.b != kNoEdge;
  });
}

}  // namespace

// Whether a vertex and a face, or two edges, are orphans follows from the vertices of that face and of the
// faces around the vertex, or along both edges: where none of these went or came, it stays so.
Orphans enumerate_orphans(const Scene& scene, const Orphans& before, const MeshRange& part,
                          const LocalChange& change, StopSignal stop) {
  Orphans orphans;
  fork_two([&] { orphans.vertex_face = follow_vertices(scene, before, part, change, stop); },
           [&] { orphans.edge_edge = follow_edges(scene, before, part, change, stop); });
  return orphans;
}

}  // namespace warmfront
