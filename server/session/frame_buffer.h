// SPDX-License-Identifier: Apache-2.0
// A frame as it arrives: all positions, or only what moved, in any number of pieces. Used by one thread at a
// time.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/frame.h"
#include "server/session/position_buffer.h"
#include "server/session/state_digest.h"

namespace warmfront::server {

/// A piece of a frame that carries only what moved; see MovedParts on the wire.
struct MovedPiece {
  std::string_view bodies = {};
  std::string_view body_positions = {};
  std::string_view pose_bodies = {};
  std::string_view poses = {};
  std::string_view vertices = {};
  std::string_view vertex_positions = {};
};

class FrameBuffer {
 public:
  FrameBuffer(Dtype dtype, const Scene& scene);

  /// Before anything is appended: positions go there.
  void reuse(PositionMemory memory) noexcept { positions_.reuse(std::move(memory)); }
  /// What they were in. Ends this buffer.
  PositionMemory release() noexcept { return positions_.release(); }

  /// Appends the next bytes of all positions, as PositionBuffer does.
  Status append(std::string_view positions);
  Status append(std::span<const std::string_view> positions);
  /// Appends the next bytes of what moved. INVALID_ARGUMENT, kept until complete(), for more than the scene
  /// could use, or in a frame that gives all positions.
  Status append(const MovedPiece& piece);

  /// INVALID_ARGUMENT unless the bytes make a frame of the scene's shape: whether its values fit is for the
  /// collider to say. The scene is the session's at the time of the step. Prepares view().
  Status complete(const Scene& scene);
  /// Once complete, and valid while the buffer is.
  Frame view() const;

  /// Takes what arrived into the digest, once complete.
  void add_to(StateDigest& digest) const;
  /// Has anything arrived?
  bool has_begun() const { return whole_ || moved_; }
  /// The bytes that arrived.
  std::size_t bytes() const { return whole_ ? positions_.expected_bytes() : received_; }
  /// The most bytes that the frame may have.
  std::size_t expected_bytes() const { return expected_; }
  std::size_t memory_bytes() const;
  /// The same bytes? What was refused is like nothing.
  friend bool operator==(const FrameBuffer& a, const FrameBuffer& b);

 private:
  enum Field : std::size_t {
    kBodies,
    kBodyPositions,
    kPoseBodies,
    kPoses,
    kVertices,
    kVertexPositions,
    kCount
  };

  Status fail(std::string message);
  std::vector<std::uint32_t> indices(Field field) const;
  Status split_bodies(const Scene& scene);
  Status split_poses(const Scene& scene);
  /// Numbers of a field in the session's dtype, which the field holds a whole number of.
  Positions numbers(Field field, std::size_t first, std::size_t count) const;

  Dtype dtype_;
  PositionBuffer positions_;
  bool whole_ = false;  // some positions arrived
  bool moved_ = false;  // a piece of what moved arrived
  std::array<std::string, kCount> bytes_;
  std::array<std::size_t, kCount> most_{};
  std::size_t expected_ = 0;
  std::size_t received_ = 0;  // of what moved
  std::optional<Error> error_;
  std::vector<BodyPositions> bodies_;
  std::vector<BodyPose> poses_;
  std::vector<std::uint32_t> vertices_;
};

}  // namespace warmfront::server
