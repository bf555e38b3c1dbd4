// SPDX-License-Identifier: Apache-2.0
#include "engine/pair_filters.h"

#include <cmath>
#include <string>

#include "engine/digits.h"

namespace warmfront {

Status PairFilters::check_numbers() const {
  if (within_edges > kMostEdges)
    return invalid_argument("filters.within_edges: is " + std::to_string(within_edges) +
                            ", and may be 0 to " + std::to_string(kMostEdges));
  if (!(near_at_rest >= 0) || !std::isfinite(near_at_rest))
    return invalid_argument("filters.near_at_rest: is " + digits_of(near_at_rest) +
                            "; give a finite length, or 0 for none");
  return {};
}

void PairFilters::rest_at(const Positions& positions) {
  if (!(near_at_rest > 0) || !rest_positions.empty()) return;
  std::visit([&](auto values) { rest_positions.assign(values.begin(), values.end()); }, positions);
}

void PairFilters::append_body(std::uint32_t count, std::span<const double> positions) {
  if (!patches.empty()) patches.resize(patches.size() + count, 0);
  if (near_at_rest > 0) rest_positions.insert(rest_positions.end(), positions.begin(), positions.end());
}

void PairFilters::replace_body(std::uint32_t first, std::uint32_t count, std::uint32_t new_count,
                               std::span<const double> positions) {
  const auto make_way = [&](auto& list, std::ptrdiff_t each) {
    const auto at = list.begin() + each * first;
    return list.erase(at, at + each * count);
  };
  if (!patches.empty()) patches.insert(make_way(patches, 1), new_count, 0);
  if (near_at_rest > 0)
    rest_positions.insert(make_way(rest_positions, 3), positions.begin(), positions.end());
}

}  // namespace warmfront
