// SPDX-License-Identifier: Apache-2.0
// How a verb sends frames: all positions, only what moved, or rigid bodies by poses. Used by one thread at a
// time.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "engine/frame.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "engine/screw.h"

namespace warmfront::client {

enum class SendMode : std::uint8_t {
  kAll,    ///< every frame gives all positions
  kMoved,  ///< bodies and vertices that moved
  kPoses,  ///< rigid bodies by the poses fitted to their positions, and what else moved
};
/// "all", "moved" or "poses"; empty: poses where a body of the scene moves along a screw, which it does by
/// poses alone, else all.
Result<SendMode> parse_send_mode(std::string_view name, const SceneDescription* scene = nullptr);

/// Which bodies of an input are used.
enum class BodiesMode : std::uint8_t {
  kDeclared,    ///< as declared in the input
  kDeformable,  ///< one deformable scene
  kComponents,  ///< the connected components, deformable
};
/// "declared", "deformable" or "components".
Result<BodiesMode> parse_bodies_mode(std::string_view name);
/// kInvalidArgument if the components are not ranges of vertices.
Result<SceneDescription> with_bodies(SceneDescription scene, BodiesMode mode);

class FrameModel {
 public:
  /// `first`: the scene's initial positions; all frames have their type (float or double).
  FrameModel(const SceneDescription& scene, SendMode mode, const Positions& first);

  /// The frame that moves everything to `end`; valid until the next call.
  Frame next(const Positions& end);

  SendMode mode() const { return mode_; }
  /// All positions after the last frame: `end`, up to the rounding of poses.
  std::span<const double> placed() const { return placed_; }
  /// The last frame's bytes on the wire.
  std::uint64_t bytes() const { return bytes_; }
  /// Of each body that moves along a screw, in turn, the twist of its last motion: as the
  /// engine has it where the body is posed, else none.
  std::span<const Twist> twists() const { return twists_; }
  /// Largest distance so far of a posed vertex from its given position.
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
  std::vector<Pose> poses_before_;  // of each body that moves along a screw
  std::vector<Twist> twists_;
  std::vector<std::uint32_t> vertices_;
  std::vector<float> floats_;  // rows of the single vertices
  std::vector<double> doubles_;
  std::uint64_t bytes_ = 0;
  double residual_ = 0;
};

}  // namespace warmfront::client
