// SPDX-License-Identifier: Apache-2.0
// The rows that each vertex is in, so that who assembles by vertices need not sort. Pure functions; a value
// is free to share between threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/contact.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront {

/// Compressed rows (CSR).
struct RowsByVertex {
  std::vector<std::size_t> begin;   ///< vertices + 1 offsets into `rows`
  std::vector<std::uint32_t> rows;  ///< of each vertex ascending, and each once

  std::span<const std::uint32_t> operator[](std::size_t vertex) const {
    return {rows.data() + begin[vertex], rows.data() + begin[vertex + 1]};
  }
  friend bool operator==(const RowsByVertex&, const RowsByVertex&) = default;
};

/// By a counting sort, O(rows + vertices): of the vertices of each row, as Answer's columns have them (five
/// of intersections). A row that has a vertex twice, as those of degenerate faces, is listed once. One
/// that begins with a vertex three times is of a half-space, which its last number names.
/// kInvalidArgument, naming the first, for a vertex not below `vertex_count`, and for more than 2^32 - 1
/// rows.
Result<RowsByVertex> rows_by_vertex(std::span<const std::array<std::uint32_t, 4>> rows,
                                    std::uint32_t vertex_count);
Result<RowsByVertex> rows_by_vertex(std::span<const std::array<std::uint32_t, 5>> rows,
                                    std::uint32_t vertex_count);
/// The same of contacts of this scene, of any kind.
Result<RowsByVertex> rows_by_vertex(std::span<const Contact> contacts, const Scene& scene);

}  // namespace warmfront
