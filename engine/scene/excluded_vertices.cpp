// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/excluded_vertices.h"

#include <algorithm>
#include <array>
#include <string>

#include "engine/parallel/stoppable_loops.h"
#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

using Pair = std::array<std::uint32_t, 2>;

bool tests_itself(const Body& body) {
  return body.kind == BodyKind::kDeformable && body.self_collision;
}

/// The other ends of each vertex's edges, and of listed pairs: rows in the order of the pairs.
struct Ends {
  std::vector<std::size_t> begin;
  std::vector<std::uint32_t> items;

  /// `for_pairs(visit)` calls `visit(a, b)` for the same pairs each time.
  template <class ForPairs>
  Ends(std::size_t vertices, ForPairs&& for_pairs, StopSignal stop) {
    lengthen(begin, vertices + 1, std::size_t{0}, stop);
    for_pairs([&](std::uint32_t a, std::uint32_t b) {
      ++begin[a + 1];
      ++begin[b + 1];
    });
    in_pieces(1, begin.size(), stop, [&](std::size_t first, std::size_t end) {
      for (std::size_t v = first; v < end; ++v) begin[v] += begin[v - 1];
    });
    lengthen(items, begin.back(), 0U, stop);
    std::vector<std::size_t> next;
    append(next, std::span<const std::size_t>(begin), stop);
    for_pairs([&](std::uint32_t a, std::uint32_t b) {
      items[next[a]++] = b;
      items[next[b]++] = a;
    });
  }
  std::span<const std::uint32_t> of(std::uint32_t v) const {
    return {items.data() + begin[v], items.data() + begin[v + 1]};
  }
};

}  // namespace

ExcludedVertices::ExcludedVertices(const PairFilters& filters, std::span<const FeatureRange> parts,
                                   const Renumbering& numbering, const Scene& renumbered, StopSignal stop) {
  if (filters.within_edges == 0 && filters.excluded_vertex_pairs.empty()) return;
  const std::size_t vertices = renumbered.vertex_count();
  PacedStop paced(stop);
  const Ends along_edges(
      vertices,
      [&](auto&& visit) {
        if (filters.within_edges == 0) return;
        for (const FeatureRange& part : parts) {
          for (const Edge& edge :
               renumbered.edges().subspan(number_of(part.first_edge), part.end_edge - part.first_edge)) {
            paced.check();
            if (edge[0] != edge[1]) visit(edge[0], edge[1]);
          }
        }
      },
      stop);
  const Ends listed(
      vertices,
      [&](auto&& visit) {
        for (const auto& [a, b] : filters.excluded_vertex_pairs) {
          paced.check();
          visit(number_of(numbering.renumbered(GivenVertex{a})),
                number_of(numbering.renumbered(GivenVertex{b})));
        }
      },
      stop);

  std::vector<std::uint32_t> seen_from;
  lengthen(seen_from, vertices, 0U, stop);  // counted from 1
  reserve(begin_, vertices + 1, stop);
  begin_.push_back(0);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const std::size_t first = items_.size();
    const auto take = [&](std::uint32_t w) {
      paced.check();
      if (std::exchange(seen_from[w], v + 1) != v + 1) items_.push_back(w);
    };
    seen_from[v] = v + 1;
    for (const std::uint32_t w : along_edges.of(v)) take(w);
    // A ring is what its predecessor leads to and has not seen.
    for (std::size_t ring = 1, from = first; ring < filters.within_edges; ++ring) {
      const std::size_t end = items_.size();
      for (; from < end; ++from) {
        for (const std::uint32_t w : along_edges.of(items_[from])) take(w);
      }
    }
    for (const std::uint32_t w : listed.of(v)) take(w);
    std::ranges::sort(std::span(items_).subspan(first));
    begin_.push_back(items_.size());
  }
  items_.shrink_to_fit();
}

// Bit j is set where the row holds w[j].
WARMFRONT_TARGET_CLONES
std::uint32_t held_of(const std::uint32_t* row, std::size_t size, const Face& w) {
  // Without a branch, so that the compiler compares several numbers at a time.
  std::uint32_t found0 = 0, found1 = 0, found2 = 0;
  for (std::size_t i = 0; i < size; ++i) {
    found0 |= row[i] == w[0] ? 1U : 0U;
    found1 |= row[i] == w[1] ? 2U : 0U;
    found2 |= row[i] == w[2] ? 4U : 0U;
  }
  return found0 | found1 | found2;
}

std::uint32_t ExcludedVertices::pairs_of(const Face& f, const Face& g) const {
  constexpr std::size_t kShort = 256;  // three rings of a regular mesh are 36 vertices
  const auto [least, most] = std::ranges::minmax(g);
  std::uint32_t pairs = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::span<const std::uint32_t> row = of(f[i]);
    // Vertices that are far from each other have numbers that are, too.
    if (row.empty() || most < row.front() || least > row.back()) continue;
    if (row.size() <= kShort) {
      pairs |= held_of(row.data(), row.size(), g) << (3 * i);
    } else {
      for (std::uint32_t j = 0; j < 3; ++j) pairs |= contains(f[i], g[j]) ? 1U << (3 * i + j) : 0;
    }
  }
  return pairs;
}

Status check_rings(const Scene& scene, StopSignal stop, std::uint32_t* worst) {
  const std::uint32_t rings = scene.filters().within_edges;
  if (rings == 0) return {};
  std::vector<std::uint32_t> degree;
  lengthen(degree, scene.vertex_count(), 0U, stop);
  PacedStop paced(stop);
  const auto for_edges = [&](auto&& visit) {
    for (const Edge& edge : scene.edges()) {
      paced.check();
      if (edge[0] == edge[1]) continue;
      if (scene.bodies().empty() || tests_itself(scene.bodies()[scene.body_of_vertex()[edge[0]]]))
        visit(edge[0], edge[1]);
    }
  };
  for_edges([&](std::uint32_t a, std::uint32_t b) {
    ++degree[a];
    ++degree[b];
  });
  std::uint64_t ways = 0;
  if (rings == 3) {
    for_edges([&](std::uint32_t a, std::uint32_t b) { ways += 2ULL * degree[a] * degree[b]; });
  } else {
    for (const std::uint64_t edges : degree) {
      paced.check();
      ways += rings == 1 ? edges : edges * edges;
    }
  }
  const std::uint64_t most = std::max(kMostWays, kMostWaysAVertex * scene.vertex_count());
  if (ways <= most) return {};
  const auto hub = static_cast<std::uint32_t>(std::ranges::max_element(degree) - degree.begin());
  if (worst != nullptr) *worst = hub;
  return Error{ErrorCode::kResourceExhausted,
               "filters.within_edges: there are " + std::to_string(ways) + " ways of " +
                   std::to_string(rings) + " edges in bodies that are tested against themselves, more than " +
                   std::to_string(most) + "; vertex " + std::to_string(hub) + " alone is in " +
                   std::to_string(degree[hub]) +
                   " edges: split it, leave out fewer edges, or switch its body's self_collision off"};
}

}  // namespace warmfront
