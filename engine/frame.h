// SPDX-License-Identifier: Apache-2.0
// What a caller says of a step: where things are at its end. Plain views; what they refer to outlives the
// call that they are given to.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "engine/pose.h"

namespace warmfront {

/// Row-major (n, 3) vertex positions in the scene's length unit; float32 is converted to double exactly.
using Positions = std::variant<std::span<const float>, std::span<const double>>;

/// All vertices of one body, (k, 3).
struct BodyPositions {
  std::uint32_t body;
  Positions positions;
};

/// The pose of a rigid body, of its rest shape: its positions last given, in a frame or when it was made.
struct BodyPose {
  std::uint32_t body;
  Pose pose;
};

/// A frame: either all vertices, or only what moved, in any mixture. What is not mentioned rests where it is.
/// It is the end of a motion, always: a body that is put elsewhere (reset, respawned) is tested along the
/// straight way there, and meets what lies on it. Make the scene again, or remove the body and add another.
struct Frame {
  Frame() = default;
  Frame(const Positions& all) : positions(all) {}         // NOLINT: implicit by design
  Frame(std::span<const double> all) : positions(all) {}  // NOLINT: implicit by design
  Frame(std::span<const float> all) : positions(all) {}   // NOLINT: implicit by design

  std::optional<Positions> positions;  ///< of all n vertices; then the rest is empty
  std::span<const BodyPositions> bodies;
  std::span<const BodyPose> poses;
  /// Single vertices, each once, and where they go: (k, 3).
  std::span<const std::uint32_t> vertices;
  Positions vertex_positions;
};

}  // namespace warmfront
