// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/local_change.h"

#include <algorithm>
#include <utility>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

constexpr std::uint32_t kNone = LocalChange::kNone;
constexpr EdgeId kNoEdge = LocalChange::kNoEdge;
using Near = LocalChange::Near;

// Around a vertex of more faces none is looked for: what it costs would grow with the square of them.
constexpr std::size_t kMostAround = 64;

// Compared as numbers, not as bytes.
bool same(const Face& f, const Face& g) {
  return f[0] == g[0] && f[1] == g[1] && f[2] == g[2];
}
std::uint64_t key_of(const Edge& edge) {
  return std::uint64_t{edge[0]} << 32 | edge[1];
}

// Of numbers, kNone left out, a longest ascending choice: all others become kNone.
void keep_ascending(std::vector<std::uint32_t>& numbers, StopSignal stop) {
  std::vector<std::uint32_t> last;  // by length: the place where a choice of that length ends with the least
  std::vector<std::uint32_t> before;  // by place: the one before it in its choice
  reserve(last, numbers.size(), stop);
  lengthen(before, numbers.size(), kNone, stop);
  PacedStop paced(stop);
  for (std::uint32_t i = 0; i < numbers.size(); ++i) {
    paced.check();
    if (numbers[i] == kNone) continue;
    auto at = last.end();
    if (!last.empty() && numbers[last.back()] >= numbers[i])
      at =
          std::ranges::lower_bound(last, numbers[i], {}, [&](std::uint32_t place) { return numbers[place]; });
    if (at != last.begin()) before[i] = *std::prev(at);
    if (at == last.end())
      last.push_back(i);
    else
      *at = i;
  }
  std::uint32_t kept = last.empty() ? kNone : last.back();
  for (auto i = static_cast<std::uint32_t>(numbers.size()); i-- > 0;) {
    paced.check();
    if (i == kept)
      kept = before[i];
    else
      numbers[i] = kNone;
  }
}

// By face of `alone`: the same before, by its place among those given; kNone for none.
std::vector<std::uint32_t> same_faces(const Scene& before, const Renumbering& numbering,
                                      const MeshRange& part, const Scene& alone, const Renumbering& vertices,
                                      StopSignal stop) {
  std::vector<std::uint32_t> places;
  reserve(places, alone.face_count(), stop);
  std::uint32_t next = 0;  // where the last one was found, and one more
  PacedStop paced(stop);
  for (const Face& given : alone.faces()) {
    paced.check();
    Face face;
    for (std::size_t k = 0; k < 3; ++k)
      face[k] = number_of(vertices.renumbered(GivenVertex{given[k]})) + part.features.first_vertex;
    std::uint32_t found = kNone;
    if (next < part.face_count() &&
        same(before.faces()[number_of(numbering.renumbered(GivenFace{part.first_face + next}))], face)) {
      found = next;
    } else if (const auto around = before.vertex_faces()[face[0]]; around.size() <= kMostAround) {
      for (const std::uint32_t f : around) {
        if (!same(before.faces()[f], face)) continue;
        found = number_of(numbering.given(NewFace{f})) - part.first_face;
        if (found >= next) break;
      }
    }
    if (found != kNone) next = found + 1;
    places.push_back(found);
  }
  keep_ascending(places, stop);
  return places;
}

class Neighbourhood {
 public:
  Neighbourhood(const Scene& alone, StopSignal stop) : alone_(alone), paced_(stop) {
    lengthen(near_, alone.vertex_count(), Near::kFar, stop);
  }
  void touch(std::uint32_t vertex) { mark(vertex, Near::kAt, at_); }
  std::vector<Near> widened() && {
    widen(Near::kBeside);
    widen(Near::kNext);
    return std::move(near_);
  }

 private:
  void mark(std::uint32_t vertex, Near as, std::vector<std::uint32_t>& list) {
    if (near_[vertex] != Near::kFar) return;
    near_[vertex] = as;
    list.push_back(vertex);
  }
  void widen(Near as) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t v : at_) {
      for (const std::uint32_t f : alone_.vertex_faces()[v]) {
        paced_.check();
        for (const std::uint32_t w : alone_.faces()[f]) mark(w, as, next);
      }
      for (const EdgeId e : lone_edges_of(alone_, v)) {
        paced_.check();
        for (const std::uint32_t w : ends_of(alone_, e)) mark(w, as, next);
      }
    }
    at_ = std::move(next);
  }

  const Scene& alone_;
  PacedStop paced_;
  std::vector<Near> near_;
  std::vector<std::uint32_t> at_;  // those marked last
};

}  // namespace

void LocalChange::renumber(const Renumbering& numbering, StopSignal stop) {
  std::vector<std::uint32_t> faces;
  reserve(faces, face_before.size(), stop);
  PacedStop paced(stop);
  for (std::uint32_t f = 0; f < face_before.size(); ++f) {
    paced.check();
    faces.push_back(face_before[number_of(numbering.given(NewFace{f}))]);
  }
  face_before = std::move(faces);
  for (std::uint32_t& f : face_of) {
    paced.check();
    if (f != kNone) f = number_of(numbering.renumbered(GivenFace{f}));
  }
  std::vector<Near> vertices;
  reserve(vertices, near.size(), stop);
  for (const GivenVertex v : numbering.given_vertices()) {
    paced.check();
    vertices.push_back(near[number_of(v)]);
  }
  near = std::move(vertices);
}

std::optional<LocalChange> find_local_change(const Scene& before, const Renumbering& numbering,
                                             const MeshRange& part, const Scene& alone,
                                             std::span<const GivenVertex> given_vertices, StopSignal stop) {
  const Renumbering vertices({given_vertices.begin(), given_vertices.end()});
  LocalChange change;
  change.face_before = same_faces(before, numbering, part, alone, vertices, stop);
  lengthen(change.face_of, part.face_count(), kNone, stop);
  std::size_t others = part.face_count();  // went or came
  Neighbourhood near(alone, stop);
  PacedStop paced(stop);
  for (std::uint32_t f = 0; f < change.face_before.size(); ++f) {
    paced.check();
    std::uint32_t& old = change.face_before[f];
    if (old != kNone) {
      old = number_of(numbering.renumbered(GivenFace{part.first_face + old})) - part.first_face;
      change.face_of[old] = f;
      --others;
      continue;
    }
    ++others;
    for (const std::uint32_t v : alone.faces()[f]) near.touch(v);
  }
  if (others * LocalChange::kLeastShare > std::size_t{alone.face_count()} + part.face_count())
    return std::nullopt;
  const auto given = [&](std::uint32_t v) {
    return number_of(given_vertices[v - part.features.first_vertex]);
  };
  for (std::uint32_t f = 0; f < change.face_of.size(); ++f) {
    paced.check();
    if (change.face_of[f] != kNone) continue;
    for (const std::uint32_t v : before.faces()[part.first_face + f]) near.touch(given(v));
  }
  // Both are sorted by given vertices.
  lengthen(change.edge_before, alone.edge_count(), kNoEdge, stop);
  lengthen(change.edge_of, part.edge_count(), kNoEdge, stop);
  const EdgeId end{alone.edge_count()};
  EdgeId at{0};
  for (std::uint32_t e = 0; e < part.edge_count(); ++e) {
    paced.check();
    const Edge& old = ends_of(before, part.features.first_edge + e);
    const std::uint64_t key = key_of({given(old[0]), given(old[1])});
    while (at < end && key_of(ends_of(alone, at)) < key) {
      paced.check();
      ++at;
    }
    if (at == end || key_of(ends_of(alone, at)) != key) continue;
    change.edge_of[e] = at;
    change.edge_before[number_of(at)] = EdgeId{e};
  }
  const auto is_among = [](const auto& ascending, EdgeId e) {
    return std::ranges::binary_search(ascending, e);
  };
  const auto lone_before = lone_edges(before);
  for (auto lone = std::ranges::lower_bound(lone_before, part.features.first_edge);
       lone != lone_before.end() && *lone < part.features.end_edge; ++lone) {
    paced.check();
    const EdgeId now = change.edge_of[*lone - part.features.first_edge];
    if (now != kNoEdge && is_among(lone_edges(alone), now)) continue;
    for (const std::uint32_t v : ends_of(before, *lone)) near.touch(given(v));
  }
  for (const EdgeId e : lone_edges(alone)) {
    paced.check();
    const EdgeId old = change.edge_before[number_of(e)];
    if (old != kNoEdge && is_among(lone_before, part.features.first_edge + number_of(old))) continue;
    for (const std::uint32_t v : ends_of(alone, e)) near.touch(v);
  }
  change.near = std::move(near).widened();
  return change;
}

}  // namespace warmfront
