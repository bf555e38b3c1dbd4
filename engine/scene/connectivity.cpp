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

EdgeTable find_edges(std::span<const Face> faces, StopSignal stop) {
  PacedStop paced(stop);
  struct Side {
    Edge edge;
    std::uint32_t face_side;  // 3 * face + side
  };
  std::vector<Side> sides;
  sides.reserve(faces.size() * 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    paced.check();
    for (std::uint32_t side = 0; side < 3; ++side) {
      const std::uint32_t from = faces[f][side];
      const std::uint32_t to = faces[f][(side + 1) % 3];
      sides.push_back({{std::min(from, to), std::max(from, to)}, static_cast<std::uint32_t>(3 * f + side)});
    }
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
    if (table.edges.empty() || table.edges.back() != side.edge) table.edges.push_back(side.edge);
    table.face_edges[side.face_side / 3][side.face_side % 3] =
        static_cast<std::uint32_t>(table.edges.size() - 1);
  }
  return table;
}

std::vector<std::uint32_t> connected_components(std::span<const Face> faces, std::uint32_t vertex_count,
                                                std::uint32_t& count, StopSignal stop) {
  PacedStop paced(stop);
  std::vector<std::uint32_t> root(vertex_count);
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&root](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const Face& face : faces) {
    paced.check();
    for (int corner = 1; corner < 3; ++corner) {
      const std::uint32_t a = find(face[0]);
      const std::uint32_t b = find(face[corner]);
      root[std::max(a, b)] = std::min(a, b);  // a root is always the least vertex of its component
    }
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
