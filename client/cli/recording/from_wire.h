// SPDX-License-Identifier: Apache-2.0
// Converts a recording's messages to the engine's types. Pure functions; a WireFrame is used by one thread at
// a time.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/io/mesh.h"
#include "engine/collider.h"
#include "engine/options.h"
#include "engine/result.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

/// Unset fields take the engine's default; kInvalidArgument for options that cannot be combined.
Result<ColliderOptions> options_of(const v1::ColliderOptions& message);
/// Everything but the faces, the edges and the filters.
Result<SceneDescription> scene_of(const v1::SessionHeader& header);
/// Initial poses of rigid bodies that are not at their reference positions.
Result<std::vector<BodyPose>> poses_of(const v1::SessionHeader& header);
/// (m, 3) faces from 12 m bytes; (k, 2) edges from 8 k; (n, 3) positions from 3 n numbers. kInvalidArgument
/// for any other length, which names `where`.
Result<std::vector<std::array<std::int32_t, 3>>> faces_of(const std::string& bytes, const std::string& where);
Result<std::vector<std::array<std::int32_t, 2>>> edges_of(const std::string& bytes, const std::string& where);
Result<PositionBuffer> positions_of(const std::string& bytes, bool float32, std::uint64_t vertices,
                                    const std::string& where);

/// A frame, from the parts in which it was sent.
class WireFrame {
 public:
  /// `scene` as it is before this step. kInvalidArgument if lengths and indices do not fit it, as in the
  /// daemon; the collider checks the values.
  static Result<WireFrame> read(std::span<const v1::StepFrame> parts, bool float32, const Scene& scene);

  /// Valid as long as this object, which may be moved.
  Frame frame() const;

 private:
  PositionBuffer positions_;
  bool whole_ = false;
  std::vector<PositionBuffer> body_positions_;
  std::vector<BodyPositions> bodies_;
  std::vector<BodyPose> poses_;
  std::vector<std::uint32_t> vertices_;
  PositionBuffer vertex_positions_;
};

}  // namespace warmfront::client
