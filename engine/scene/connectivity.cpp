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

EdgeTable find_edges(std::span<const Face> faces, std::span<const GivenEdge> more, StopSignal stop) {
  PacedStop paced(stop);
  struct Side {
    Edge edge;
    std::uint32_t face_side;  // 3 * face + side; after all of these kNoFace
  };
  constexpr std::uint32_t kNoFace = 0xffffffff;
  std::vector<Side> sides;
  sides.reserve(faces.size() * 3 + more.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    paced.check();
    for (std::uint32_t side = 0; side < 3; ++side) {
      const std::uint32_t from = faces[f][side];
      const std::uint32_t to = faces[f][(side + 1) % 3];
      sides.push_back({{std::min(from, to), std::max(from, to)}, static_cast<std::uint32_t>(3 * f + side)});
    }
  }
  for (const GivenEdge& edge : more) {
    paced.check();
    const auto [from, to] =
        std::minmax({static_cast<std::uint32_t>(edge[0]), static_cast<std::uint32_t>(edge[1])});
    sides.push_back({{from, to}, kNoFace});
  }
  std::sort(sides.begin(), sides.end(), [&](const Side& x, const Side& y) {
    paced.check();
    return std::tie(x.edge, x.face_side) < std::tie(y.edge, y.face_side);
  });
  std::size_t edges = 0;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    paced.check();
    edges += i == 0 || sides[i].edge != sides[i - 1].edge ? 1 : 0;
  }
  EdgeTable table;
  table.edges.reserve(edges);
  lengthen(table.face_edges, faces.size(), {}, stop);
  for (const Side& side : sides) {
    paced.check();
    const bool is_new = table.edges.empty() || table.edges.back() != side.edge;
    if (is_new) table.edges.push_back(side.edge);
    const auto edge = static_cast<std::uint32_t>(table.edges.size() - 1);
    if (side.face_side != kNoFace)
      table.face_edges[side.face_side / 3][side.face_side % 3] = edge;
    else if (is_new)
      table.lone_edges.push_back(edge);
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
