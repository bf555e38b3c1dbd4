// SPDX-License-Identifier: Apache-2.0
#include "engine/rows_by_vertex.h"

#include <algorithm>
#include <limits>
#include <string>

namespace warmfront {
namespace {

// `visit(row, take)` calls `take(vertex)` for each vertex of a row.
template <class Visit>
Result<RowsByVertex> sorted_by_vertex(std::size_t row_count, std::uint32_t vertex_count, Visit visit) {
  if (row_count > std::numeric_limits<std::uint32_t>::max())
    return invalid_argument("rows: " + std::to_string(row_count) + " are more than 2^32 - 1");
  RowsByVertex sorted;
  // Counts two places on, so that filling moves each beginning to its end, which is where the next begins.
  sorted.begin.resize(std::size_t{vertex_count} + 2);
  for (std::size_t row = 0; row < row_count; ++row) {
    std::uint32_t beyond = 0;
    bool bad = false;
    visit(row, [&](std::uint32_t v) {
      if (v < vertex_count) {
        ++sorted.begin[std::size_t{v} + 2];
      } else if (!bad) {
        bad = true;
        beyond = v;
      }
    });
    if (bad)
      return invalid_argument("rows[" + std::to_string(row) + "]: vertex " + std::to_string(beyond) +
                              " is not in [0, " + std::to_string(vertex_count) + ")");
  }
  for (std::size_t v = 1; v < sorted.begin.size(); ++v) sorted.begin[v] += sorted.begin[v - 1];
  sorted.rows.resize(sorted.begin.back());
  for (std::size_t row = 0; row < row_count; ++row) {
    visit(row, [&](std::uint32_t v) {
      sorted.rows[sorted.begin[std::size_t{v} + 1]++] = static_cast<std::uint32_t>(row);
    });
  }
  sorted.begin.pop_back();
  return sorted;
}

template <std::size_t N, class Take>
void each_once(const std::array<std::uint32_t, N>& vertices, Take take) {
  // Of a half-space: its number follows the vertex, which stands three times in no other row.
  if (vertices[0] == vertices[1] && vertices[0] == vertices[2]) return take(vertices[0]);
  for (std::size_t k = 0; k < N; ++k) {
    const auto here = vertices.begin() + static_cast<std::ptrdiff_t>(k);
    if (std::find(vertices.begin(), here, vertices[k]) == here) take(vertices[k]);
  }
}

template <std::size_t N>
Result<RowsByVertex> of_vertices(std::span<const std::array<std::uint32_t, N>> rows,
                                 std::uint32_t vertex_count) {
  return sorted_by_vertex(rows.size(), vertex_count,
                          [&](std::size_t row, auto take) { each_once(rows[row], take); });
}

}  // namespace

Result<RowsByVertex> rows_by_vertex(std::span<const std::array<std::uint32_t, 4>> rows,
                                    std::uint32_t vertex_count) {
  return of_vertices(rows, vertex_count);
}

Result<RowsByVertex> rows_by_vertex(std::span<const std::array<std::uint32_t, 5>> rows,
                                    std::uint32_t vertex_count) {
  return of_vertices(rows, vertex_count);
}

Result<RowsByVertex> rows_by_vertex(std::span<const Contact> contacts, const Scene& scene) {
  return sorted_by_vertex(contacts.size(), scene.vertex_count(), [&](std::size_t row, auto take) {
    const Contact& contact = contacts[row];
    if (contact.kind == ContactKind::kEdgeFace)
      each_once(scene.edge_face_vertices_of(contact), take);
    else
      each_once(scene.vertices_of(contact), take);
  });
}

}  // namespace warmfront
