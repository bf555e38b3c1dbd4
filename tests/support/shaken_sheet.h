// SPDX-License-Identifier: Apache-2.0
// A flat sheet of squares, and what crumples it.
#pragma once

#include <cstddef>
#include <random>
#include <vector>

namespace warmfront::testing {

/// Squares along each side; their triangles are more than a hierarchy's subtree.
inline constexpr int kSheetCells = 24;
inline constexpr std::size_t kSheetVertices = (kSheetCells + 1) * (kSheetCells + 1);

/// Positions (kSheetVertices, 3) for grid(kSheetCells).
inline std::vector<double> flat_sheet() {
  std::vector<double> positions;
  for (int i = 0; i <= kSheetCells; ++i) {
    for (int j = 0; j <= kSheetCells; ++j) positions.insert(positions.end(), {i * 0.1, j * 0.1, 0.0});
  }
  return positions;
}

/// Moves by as much as `most` in each coordinate.
inline void shake(std::mt19937_64& random, double most, std::vector<double>& positions) {
  std::uniform_real_distribution<double> by(-most, most);
  for (double& x : positions) x += by(random);
}

}  // namespace warmfront::testing
