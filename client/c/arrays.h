// SPDX-License-Identifier: Apache-2.0
// Callers' arrays, which are looked at during a call alone. Thread safe.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "engine/pair_filters.h"
#include "engine/result.h"

namespace warmfront::c {

/// An array of so many numbers, or none; kInvalidArgument for numbers without an array.
template <class T>
Result<std::span<const T>> rows(const T* first, std::size_t count, const std::string& field) {
  if (first == nullptr && count > 0)
    return invalid_argument(field + ": is null, and " + std::to_string(count) + " numbers are expected");
  return std::span<const T>(first, first == nullptr ? 0 : count);
}

template <class Row>
Status copy_rows(const typename Row::value_type* first, std::size_t count, const std::string& field,
                 std::vector<Row>& into) {
  const auto given = rows(first, count * std::tuple_size_v<Row>, field);
  if (!given) return given.error();
  into.resize(count);
  if (count > 0) std::memcpy(into.data(), first, count * sizeof(Row));
  return {};
}

template <class T>
void copy_optional(const T* first, std::size_t count, std::vector<T>& into) {
  if (first != nullptr) into.assign(first, first + count);
}

/// Of a wf_scene or a wf_change, which have the same fields; errors name them behind `where`.
template <class From>
Result<PairFilters> filters_of(const From& from, const std::string& where = {}) {
  PairFilters filters;
  filters.within_edges = from.within_edges;
  filters.near_at_rest = from.near_at_rest;
  copy_optional(from.rest_positions, std::size_t{3} * from.vertex_count, filters.rest_positions);
  if (Status taken = copy_rows(from.excluded_vertex_pairs, from.excluded_vertex_pair_count,
                               where + "excluded_vertex_pairs", filters.excluded_vertex_pairs);
      !taken)
    return taken.error();
  copy_optional(from.patches, from.vertex_count, filters.patches);
  return filters;
}

}  // namespace warmfront::c
