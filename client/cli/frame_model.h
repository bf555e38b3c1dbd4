// SPDX-License-Identifier: Apache-2.0
// How a verb gives its frames: all positions, only what moved, or rigid bodies by poses. Used by one thread
// at a time.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "engine/frame.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

enum class SendMode : std::uint8_t {
  kAll,    ///< every frame gives all positions
  kMoved,  ///< bodies and vertices that moved
  kPoses,  ///< rigid bodies by the poses fitted to their positions, and what else moved
};
/// "all", "moved" or "poses".
Result<SendMode> parse_send_mode(std::string_view name);

/// What is taken of an input's bodies.
enum class BodiesMode : std::uint8_t {
  kDeclared,    ///< as the input says
  kDeformable,  ///< one deformable scene
  kComponents,  ///< the connected components, deformable
};
/// "declared", "deformable" or "components".
Result<BodiesMode> parse_bodies_mode(std::string_view name);
/// kInvalidArgument where the components are no ranges of vertices.
Result<SceneDescription> with_bodies(SceneDescription scene, BodiesMode mode);

class FrameModel {
 public:
  /// `first`: the positions that the scene begins with; all frames are of their kind (float or double).
  FrameModel(const SceneDescription& scene, SendMode mode, const Positions& first);

  /// The frame that brings everything to `end`; valid until the next call.
  Frame next(const Positions& end);

  /// Where the frame last given puts everything: `end` itself, but for what poses round.
  std::span<const double> placed() const { return placed_; }
  /// The bytes that it takes on the wire.
  std::uint64_t bytes() const { return bytes_; }
  /// The farthest that a pose put a vertex from where it was said to be, so far.
  double residual() const { return residual_; }

 private:
  template <class Real>
  Frame next_of(std::span<const Real> end, std::vector<Real>& rows);
  template <class Real>
  void pose(std::uint32_t body, std::span<const Real> end);

  const SceneDescription& scene_;
  const SendMode mode_;
  std::vector<double> rest_;
  std::vector<double> placed_;
  std::vector<BodyPositions> bodies_;
  std::vector<BodyPose> poses_;
  std::vector<std::uint32_t> vertices_;
  std::vector<float> floats_;  // rows of the single vertices
  std::vector<double> doubles_;
  std::uint64_t bytes_ = 0;
  double residual_ = 0;
};

}  // namespace warmfront::client
