// SPDX-License-Identifier: Apache-2.0
// A rippling, folding cloth that sinks through a turning ball: contacts between the two and of the cloth with
// itself in every step. Closed formulas instead of physics, the same on every machine to 2^-24, which leaves
// room for exact offsets. Plain values.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene.h"

namespace warmfront::testing {

struct ClothOverBall {
  SceneDescription description;
  /// Each row-major (n, 3), within [-2, 2].
  std::vector<std::vector<double>> frames;
};

/// A cloth of side x side quads and a ball of similar resolution.
ClothOverBall cloth_over_ball(int side, int frame_count);

/// Every coordinate times 2^exponent, then plus `offset`, rounded to double.
std::vector<double> placed(std::vector<double> positions, int exponent, double offset = 0);

}  // namespace warmfront::testing
