// SPDX-License-Identifier: Apache-2.0
#include "engine/pair_filters.h"

namespace warmfront {

void PairFilters::rest_at(const Positions& positions) {
  if (!(near_at_rest > 0) || !rest_positions.empty()) return;
  std::visit([&](auto values) { rest_positions.assign(values.begin(), values.end()); }, positions);
}

void PairFilters::append_body(std::uint32_t count, std::span<const double> positions) {
  if (!patches.empty()) patches.resize(patches.size() + count, 0);
  if (near_at_rest > 0) rest_positions.insert(rest_positions.end(), positions.begin(), positions.end());
}

}  // namespace warmfront
