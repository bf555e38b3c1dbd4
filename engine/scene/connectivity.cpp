// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/connectivity.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

Csr invert(std::span<const std::array<std::uint32_t, 3>> lists, std::size_t rows, StopSignal stop) {
  Csr csr;
  lengthen(csr.begin, rows + 1, 0U, stop);
  const auto for_each_key = [](const auto& list, auto&& visit) {
    for (std::size_t k = 0; k < list.size(); ++k)
      if (std::find(list.begin(), list.begin() + k, list[k]) == list.begin() + k) visit(list[k]);
  };
  in_pieces(0, lists.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      for_each_key(lists[i], [&](std::uint32_t key) { ++csr.begin[key + 1]; });
  });
  in_pieces(1, csr.begin.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t row = first; row < end; ++row) csr.begin[row] += csr.begin[row - 1];
  });
  lengthen(csr.items, csr.begin.back(), 0U, stop);
  std::vector<std::uint32_t> cursor;
  append(cursor, std::span<const std::uint32_t>(csr.begin), stop);
  in_pieces(0, lists.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      for_each_key(lists[i],
                   [&](std::uint32_t key) { csr.items[cursor[key]++] = static_cast<std::uint32_t>(i); });
  });
  return csr;
}

// Sides are dealt to their lesser vertices, and sorted there: few each, whatever the number of all.
EdgeTable find_edges(std::span<const Face> faces, std::span<const GivenEdge> more, StopSignal stop) {
  PacedStop paced(stop);
  struct Side {
    std::uint32_t greater;    // vertex
    std::uint32_t face_side;  // 3 * face + side; after all of these kNoFace
  };
  constexpr std::uint32_t kNoFace = 0xffffffff;
  const auto for_sides = [&](auto&& visit) {
    for (std::size_t f = 0; f < faces.size(); ++f) {
      paced.check();
      for (std::uint32_t side = 0; side < 3; ++side) {
        const std::uint32_t from = faces[f][side];
        const std::uint32_t to = faces[f][(side + 1) % 3];
        visit(std::min(from, to), std::max(from, to), static_cast<std::uint32_t>(3 * f + side));
      }
    }
    for (const GivenEdge& edge : more) {
      paced.check();
      const auto [from, to] =
          std::minmax({static_cast<std::uint32_t>(edge[0]), static_cast<std::uint32_t>(edge[1])});
      visit(from, to, kNoFace);
    }
  };
  std::uint32_t vertices = 0;
  for_sides(
      [&](std::uint32_t lesser, std::uint32_t, std::uint32_t) { vertices = std::max(vertices, lesser + 1); });
  std::vector<std::uint32_t> next;
  lengthen(next, std::size_t{vertices} + 1, 0U, stop);
  for_sides([&](std::uint32_t lesser, std::uint32_t, std::uint32_t) { ++next[lesser + 1]; });
  in_pieces(1, next.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t v = first; v < end; ++v) next[v] += next[v - 1];
  });
  std::vector<Side> sides;
  lengthen(sides, next.back(), Side{}, stop);
  for_sides([&](std::uint32_t lesser, std::uint32_t greater, std::uint32_t face_side) {
    sides[next[lesser]++] = {greater, face_side};
  });
  // Now next[v] is where the sides of v end.
  std::size_t edges = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    paced.check();
    const std::span<Side> of_vertex(sides.begin() + (v == 0 ? 0 : next[v - 1]), sides.begin() + next[v]);
    std::sort(of_vertex.begin(), of_vertex.end(), [&](const Side& x, const Side& y) {
      paced.check();
      return std::tie(x.greater, x.face_side) < std::tie(y.greater, y.face_side);
    });
    for (std::size_t i = 0; i < of_vertex.size(); ++i) {
      paced.check();
      edges += i == 0 || of_vertex[i].greater != of_vertex[i - 1].greater ? 1 : 0;
    }
  }
  EdgeTable table;
  table.edges.reserve(edges);
  lengthen(table.face_edges, faces.size(), {}, stop);
  std::size_t at = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    for (const std::size_t first = at; at < next[v]; ++at) {
      paced.check();
      const bool is_new = at == first || sides[at].greater != sides[at - 1].greater;
      if (is_new) table.edges.push_back({v, sides[at].greater});
      const auto number = static_cast<std::uint32_t>(table.edges.size() - 1);
      const std::uint32_t face_side = sides[at].face_side;
      if (face_side != kNoFace)
        table.face_edges[face_side / 3][face_side % 3] = number;
      else if (is_new)
        table.lone_edges.push_back(number);
    }
  }
  return table;
}

Csr lone_edges_of_vertices(std::span<const Edge> edges, std::span<const std::uint32_t> lone_edges,
                           std::uint32_t vertex_count, StopSignal stop) {
  Csr csr;
  if (lone_edges.empty()) return csr;
  PacedStop paced(stop);
  lengthen(csr.begin, std::size_t{vertex_count} + 1, 0U, stop);
  const auto for_ends = [&](auto&& visit) {
    for (const std::uint32_t e : lone_edges) {
      paced.check();
      for (const std::uint32_t v : edges[e]) visit(v, e);
    }
  };
  for_ends([&](std::uint32_t v, std::uint32_t) { ++csr.begin[v + 1]; });
  in_pieces(1, csr.begin.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t row = first; row < end; ++row) csr.begin[row] += csr.begin[row - 1];
  });
  lengthen(csr.items, csr.begin.back(), 0U, stop);
  std::vector<std::uint32_t> next;
  append(next, std::span<const std::uint32_t>(csr.begin), stop);
  for_ends([&](std::uint32_t v, std::uint32_t e) { csr.items[next[v]++] = e; });
  return csr;
}

std::vector<std::uint32_t> connected_components(std::span<const Face> faces, std::span<const Edge> edges,
                                                std::span<const std::uint32_t> lone_edges,
                                                std::uint32_t vertex_count, std::uint32_t& count,
                                                StopSignal stop) {
  PacedStop paced(stop);
  std::vector<std::uint32_t> root(vertex_count);
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&root](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  const auto join = [&](std::uint32_t v, std::uint32_t w) {
    const auto [lesser, greater] = std::minmax({find(v), find(w)});
    root[greater] = lesser;  // a root is always the least vertex of its component
  };
  for (const Face& face : faces) {
    paced.check();
    join(face[0], face[1]);
    join(face[0], face[2]);
  }
  for (const std::uint32_t e : lone_edges) {
    paced.check();
    join(edges[e][0], edges[e][1]);
  }
  std::vector<std::uint32_t> component(vertex_count);
  count = 0;
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    paced.check();
    const std::uint32_t r = find(v);
    component[v] = r == v ? count++ : component[r];
  }
  return component;
}

}  // namespace warmfront
