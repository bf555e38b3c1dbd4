// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/local_change.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/adjacency.h"

namespace warmfront {
namespace {

constexpr std::uint32_t kNone = LocalChange::kNone;
constexpr EdgeId kNoEdge = LocalChange::kNoEdge;

// Around a vertex of more faces none is looked for: what it costs would grow with the square of them.
constexpr std::size_t kMostAround = 64;

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

// By face: the same before, or kNone.
std::vector<std::uint32_t> same_faces(const Scene& before, const MeshRange& part,
                                      std::span<const std::array<std::int32_t, 3>> faces, StopSignal stop) {
  const std::uint32_t first_vertex = part.features.first_vertex;
  const std::span<const Face> old = before.faces().subspan(part.first_face, part.face_count());
  std::vector<std::uint32_t> places;
  reserve(places, faces.size(), stop);
  std::uint32_t next = 0;  // where the last one was found, and one more
  bool ascend = true;
  PacedStop paced(stop);
  for (const auto& given : faces) {
    paced.check();
    const Face face{static_cast<std::uint32_t>(given[0]) + first_vertex,
                    static_cast<std::uint32_t>(given[1]) + first_vertex,
                    static_cast<std::uint32_t>(given[2]) + first_vertex};
    // Compared as numbers, not as bytes, and all of them: there is nothing to predict.
    const auto is_same = [&](const Face& f) {
      return ((f[0] ^ face[0]) | (f[1] ^ face[1]) | (f[2] ^ face[2])) == 0;
    };
    if (next < old.size() && is_same(old[next])) {
      places.push_back(next++);
      continue;
    }
    std::uint32_t found = kNone;
    if (const auto around = before.vertex_faces()[face[0]]; around.size() <= kMostAround) {
      for (const std::uint32_t f : around) {
        if (!is_same(before.faces()[f])) continue;
        found = f - part.first_face;
        if (found >= next) break;
      }
    }
    if (found != kNone) {
      ascend &= found >= next;
      next = found + 1;
    }
    places.push_back(found);
  }
  if (!ascend) keep_ascending(places, stop);
  return places;
}

// The sides of a face, each once.
template <class Visit>
void for_sides(const Face& face, Visit&& visit) {
  std::array<Edge, 3> sides;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [lesser, greater] = std::minmax({face[k], face[(k + 1) % 3]});
    sides[k] = {lesser, greater};
    if (std::find(sides.begin(), sides.begin() + static_cast<std::ptrdiff_t>(k), sides[k]) ==
        sides.begin() + static_cast<std::ptrdiff_t>(k))
      visit(sides[k]);
  }
}

// Finds what becomes of a body's edges, once its faces are known.
class EdgesOf {
 public:
  EdgesOf(const Scene& before, const MeshRange& part, StopSignal stop)
      : before_(before), part_(part), stop_(stop) {}

  // A face that went, by a count of -1, or came.
  void count_face(const Face& face, std::int32_t by) {
    for_sides(face, [&](const Edge& side) { sides_.push_back({side, by, true, false}); });
  }
  void find(std::span<const GivenEdge> edges, LocalChange& change) {
    const auto lone = lone_edges(before_);
    for (auto e = std::ranges::lower_bound(lone, part_.features.first_edge);
         e != lone.end() && *e < part_.features.end_edge; ++e)
      sides_.push_back({ends(*e), 0, false, false});
    for (const GivenEdge& edge : edges) {
      const auto [lesser, greater] =
          std::minmax({static_cast<std::uint32_t>(edge[0]), static_cast<std::uint32_t>(edge[1])});
      sides_.push_back({{lesser, greater}, 0, false, true});
    }
    const auto by_ends = [](const Side& side) { return key_of(side.ends); };
    PacedStop paced(stop_, 256);
    if (!std::ranges::is_sorted(sides_, {}, by_ends)) {
      sort_stoppably(sides_, stop_, [&](const Side& x, const Side& y) { return by_ends(x) < by_ends(y); });
    }
    for (std::size_t i = 0; i < sides_.size();) {
      Side all = sides_[i];
      while (++i < sides_.size() && sides_[i].ends == all.ends) {
        paced.check();
        all.faces += sides_[i].faces;
        all.of_face |= sides_[i].of_face;
        all.given |= sides_[i].given;
      }
      paced.check();
      take(all, change);
    }
    run_until(part_.edge_count(), change);
  }

 private:
  // What is said of an edge in one place.
  struct Side {
    Edge ends;
    std::int32_t faces;  // more along it
    bool of_face;
    bool given;  // besides, now
  };
  static std::uint64_t key_of(const Edge& edge) { return std::uint64_t{edge[0]} << 32 | edge[1]; }
  Edge ends(EdgeId e) const {
    const Edge& edge = ends_of(before_, e);
    return {edge[0] - part_.features.first_vertex, edge[1] - part_.features.first_vertex};
  }
  // Edges as they were, from the next one on.
  void run_until(std::uint32_t end, LocalChange& change) {
    if (end > next_old_) {
      const std::uint32_t count = end - next_old_;
      if (!change.edge_runs.empty() &&
          change.edge_runs.back().from + change.edge_runs.back().count == next_old_ &&
          change.edge_runs.back().to + change.edge_runs.back().count == next_)
        change.edge_runs.back().count += count;
      else
        change.edge_runs.push_back({next_old_, count, next_});
      next_old_ += count;
      next_ += count;
    }
  }
  void take(const Side& side, LocalChange& change) {
    const EdgeId first = part_.features.first_edge;
    std::uint32_t low = next_old_, high = part_.edge_count();
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      key_of(ends(first + middle)) < key_of(side.ends) ? low = middle + 1 : high = middle;
    }
    const bool was = low < part_.edge_count() && ends(first + low) == side.ends;
    const std::size_t faces_before = was ? faces_along(before_, first + low).size() : 0;
    const std::int64_t faces = static_cast<std::int64_t>(faces_before) + side.faces;
    LocalChange::Touched touched{.ends = side.ends, .of_face = side.of_face};
    touched.was_lone = was && faces_before == 0;
    touched.is_lone = faces == 0 && side.given;
    const bool is = faces > 0 || side.given;
    if (!was && !is) return;
    run_until(low, change);
    if (was) touched.before = EdgeId{low};
    if (is) touched.now = EdgeId{next_};
    if (was && is)
      run_until(low + 1, change);
    else if (was)
      ++next_old_;
    else
      ++next_;
    change.touched.push_back(touched);
  }

  const Scene& before_;
  const MeshRange part_;
  const StopSignal stop_;
  std::vector<Side> sides_;
  std::uint32_t next_old_ = 0;  // edge before, and now
  std::uint32_t next_ = 0;
};

// What stays, as runs.
void find_runs(std::span<const std::uint32_t> before, std::vector<Run>& runs, StopSignal stop) {
  runs.clear();
  Run run;  // the one that is being found, if it has any
  in_pieces(0, before.size(), stop, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      if (before[f] == run.from + run.count && run.count > 0) {
        ++run.count;
        continue;
      }
      if (run.count > 0) runs.push_back(run);
      run = {before[f], before[f] == kNone ? 0U : 1U, f};
    }
  });
  if (run.count > 0) runs.push_back(run);
}

template <class Number>
void list_both_ways(std::span<const Run> runs, std::vector<Number>& of, std::vector<Number>& before,
                    StopSignal stop) {
  for (const Run& run : runs) {
    in_pieces(0, run.count, stop, [&](std::size_t first, std::size_t end) {
      for (std::size_t i = first; i < end; ++i) {
        of[run.from + i] = Number{static_cast<std::uint32_t>(run.to + i)};
        before[run.to + i] = Number{static_cast<std::uint32_t>(run.from + i)};
      }
    });
  }
}

void sort_once_each(std::vector<std::uint32_t>& numbers, StopSignal stop) {
  sort_stoppably(numbers, stop, std::less<>());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

}  // namespace

void LocalChange::renumber(const Renumbering& before, const MeshRange& part, const Renumbering& now,
                           std::vector<std::uint32_t> faces, StopSignal stop) {
  PacedStop paced(stop);
  if (faces.empty()) {
    reserve(faces, face_before.size(), stop);
    for (std::uint32_t f = 0; f < face_before.size(); ++f) {
      paced.check();
      const std::uint32_t old = face_before[number_of(now.given(NewFace{f}))];
      faces.push_back(old == kNone
                          ? kNone
                          : number_of(before.renumbered(GivenFace{part.first_face + old})) - part.first_face);
    }
  }
  std::vector<std::uint32_t> faces_of;
  lengthen(faces_of, face_of.size(), kNone, stop);
  std::uint32_t next = 0;
  faces_ascend = true;
  in_pieces(0, faces.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t f = first; f < end; ++f) {
      const std::uint32_t old = faces[f];
      if (old == kNone) continue;
      faces_of[old] = static_cast<std::uint32_t>(f);
      faces_ascend &= old >= next;
      next = old + 1;
    }
  });
  face_before = std::move(faces);
  face_of = std::move(faces_of);
  find_runs(face_before, face_runs, stop);
  for (std::uint32_t& f : came) f = number_of(now.renumbered(GivenFace{f}));
  std::ranges::sort(came);
  for (std::uint32_t& v : at) v = number_of(now.renumbered(GivenVertex{v}));
  std::ranges::sort(at);
}

std::optional<LocalChange> find_local_change(const Scene& before, const MeshRange& part,
                                             std::span<const std::array<std::int32_t, 3>> faces,
                                             std::span<const GivenEdge> edges, StopSignal stop) {
  const std::uint32_t first_vertex = part.features.first_vertex;
  LocalChange change;
  change.face_before = same_faces(before, part, faces, stop);
  PacedStop paced(stop);
  find_runs(change.face_before, change.face_runs, stop);
  std::size_t stay = 0;
  for (const Run& run : change.face_runs) stay += run.count;
  const std::size_t others = part.face_count() + faces.size() - 2 * stay;  // went or came
  if (others * LocalChange::kLeastShare > faces.size() + part.face_count()) return std::nullopt;
  lengthen(change.face_of, part.face_count(), kNone, stop);
  list_both_ways(change.face_runs, change.face_of, change.face_before, stop);

  EdgesOf edges_of(before, part, stop);
  const auto changes = [&](const Face& face, std::int32_t by) {
    paced.check();
    edges_of.count_face(face, by);
    change.at.insert(change.at.end(), face.begin(), face.end());
  };
  std::uint32_t next = 0;  // before
  const auto went_until = [&](std::size_t end) {
    for (; next < end; ++next) {
      const auto [a, b, c] = before.faces()[part.first_face + next];
      changes({a - first_vertex, b - first_vertex, c - first_vertex}, -1);
    }
  };
  std::size_t f = 0;
  const auto came_until = [&](std::size_t end) {
    for (; f < end; ++f) {
      const auto [a, b, c] = faces[f];
      changes({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(c)},
              1);
      change.came.push_back(static_cast<std::uint32_t>(f));
    }
  };
  for (const Run& run : change.face_runs) {
    went_until(run.from);
    came_until(run.to);
    next += static_cast<std::uint32_t>(run.count);
    f += run.count;
  }
  went_until(part.face_count());
  came_until(faces.size());
  edges_of.find(edges, change);
  std::size_t lone = 0, lone_that_stay = 0;  // before and now
  for (const LocalChange::Touched& edge : change.touched) {
    paced.check();
    lone += (edge.was_lone ? 1 : 0) + (edge.is_lone ? 1 : 0);
    lone_that_stay += edge.was_lone && edge.is_lone ? 2 : 0;
  }
  if ((others + lone - lone_that_stay) * LocalChange::kLeastShare > faces.size() + part.face_count() + lone)
    return std::nullopt;
  std::size_t edge_count = 0;
  for (const Run& run : change.edge_runs) edge_count += run.count;
  for (const LocalChange::Touched& edge : change.touched) {
    edge_count += edge.before == kNoEdge ? 1 : 0;
    if (edge.was_lone != edge.is_lone) change.at.insert(change.at.end(), edge.ends.begin(), edge.ends.end());
  }
  sort_once_each(change.at, stop);
  lengthen(change.edge_before, edge_count, kNoEdge, stop);
  lengthen(change.edge_of, part.edge_count(), kNoEdge, stop);
  list_both_ways(change.edge_runs, change.edge_of, change.edge_before, stop);
  return change;
}

}  // namespace warmfront
