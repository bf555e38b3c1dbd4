// SPDX-License-Identifier: Apache-2.0
// A caller's input for a step: positions at its end. Plain views; the referenced data must outlive the call.
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

/// The pose of a rigid body, relative to its reference shape: its positions last given, in a frame or at
/// creation.
struct BodyPose {
  std::uint32_t body;
  Pose pose;
};

/// A frame: either all vertices, or only what moved, in any mixture. Everything else is stationary. A frame
/// is the end of a linear motion: a body that is moved elsewhere (reset, respawned) collides with everything
/// on the straight path, except with Collider::place().
struct Frame {
  Frame() = default;
  Frame(const Positions& all) : positions(all) {}         // NOLINT: implicit by design
  Frame(std::span<const double> all) : positions(all) {}  // NOLINT: implicit by design
  Frame(std::span<const float> all) : positions(all) {}   // NOLINT: implicit by design

  std::optional<Positions> positions;  ///< of all n vertices; then all other fields must be empty
  std::span<const BodyPositions> bodies;
  std::span<const BodyPose> poses;
  /// Single vertices, each at most once, and their positions: (k, 3).
  std::span<const std::uint32_t> vertices;
  Positions vertex_positions;

  /// Is nothing given, so that nothing moves?
  bool empty() const { return !positions && bodies.empty() && poses.empty() && vertices.empty(); }
};

}  // namespace warmfront
