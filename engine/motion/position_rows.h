// SPDX-License-Identifier: Apache-2.0
// Single values of a frame's positions, whatever their type. Pure functions.
#pragma once

#include <array>
#include <cstddef>
#include <variant>

#include "engine/frame.h"

namespace warmfront {

inline double coordinate(const Positions& positions, std::size_t index) {
  return std::visit([&](auto values) { return static_cast<double>(values[index]); }, positions);
}

inline std::array<double, 3> row(const Positions& positions, std::size_t index) {
  return {coordinate(positions, 3 * index), coordinate(positions, 3 * index + 1),
          coordinate(positions, 3 * index + 2)};
}

}  // namespace warmfront
