// SPDX-License-Identifier: Apache-2.0
#include "tests/support/cloth_over_ball.h"

#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

double rounded(double x) {
  return std::round(x * 0x1p24) * 0x1p-24;
}

}  // namespace

ClothOverBall cloth_over_ball(int side, int frame_count) {
  ClothOverBall result;
  const int cloth_vertices = (side + 1) * (side + 1);
  const int rings = side / 2;
  const int sectors = side;
  Faces& faces = result.description.faces;
  faces = grid(side);
  const auto on_ball = [&](int ring, int sector) {
    return cloth_vertices + ring * sectors + sector % sectors;
  };
  for (int ring = 0; ring + 1 < rings; ++ring) {
    for (int sector = 0; sector < sectors; ++sector) {
      faces.push_back({on_ball(ring, sector), on_ball(ring, sector + 1), on_ball(ring + 1, sector)});
      faces.push_back({on_ball(ring, sector + 1), on_ball(ring + 1, sector + 1), on_ball(ring + 1, sector)});
    }
  }
  result.description.vertex_count = static_cast<std::uint32_t>(cloth_vertices + rings * sectors);
  for (int frame = 0; frame < frame_count; ++frame) {
    std::vector<double> positions;
    const auto add = [&](double x, double y, double z) {
      for (const double c : {x, y, z}) positions.push_back(rounded(c));
    };
    for (int i = 0; i <= side; ++i) {
      for (int j = 0; j <= side; ++j) {
        const double x = 3.0 * i / side - 1.5;
        const double y = 3.0 * j / side - 1.5;
        // Folds: the sheet goes back on itself where the sine's slope is below -1.
        add(x + 0.25 * std::sin(6 * x + 0.5 * frame), y,
            1.2 - 0.3 * frame + 0.08 * std::sin(5 * x + 4 * y + frame) * std::cos(3 * y - frame));
      }
    }
    for (int ring = 0; ring < rings; ++ring) {
      const double polar = std::numbers::pi * (ring + 0.5) / rings;
      for (int sector = 0; sector < sectors; ++sector) {
        const double azimuth = 2 * std::numbers::pi * sector / sectors + 0.1 * frame;
        add(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar));
      }
    }
    result.frames.push_back(std::move(positions));
  }
  return result;
}

std::vector<double> placed(std::vector<double> positions, int exponent, double offset) {
  for (double& x : positions) x = std::ldexp(x, exponent) + offset;
  return positions;
}

}  // namespace warmfront::testing
