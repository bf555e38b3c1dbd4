// SPDX-License-Identifier: Apache-2.0
// The state needed to create a session again: its scene and all current positions. Used by one thread at a
// time.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/lib/scene_changes.h"
#include "client/lib/sent_frame.h"
#include "engine/frame.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

class SceneState {
 public:
  /// `positions` are those of the first frame; the session then uses their type, float32 or float64. They are
  /// the rest shape where the filters need one and have none.
  SceneState(SceneDescription scene, const Positions& positions);
  SceneState(SceneState&&) = default;  // not copyable: two would write to one string of positions
  SceneState& operator=(SceneState&&) = default;
  /// A copy for changes that may not come to be, with positions of its own.
  SceneState draft() const { return {*this, std::string(positions())}; }

  const SceneDescription& scene() const { return scene_; }
  bool float32() const { return float32_; }
  /// The upload's positions: (n, 3) in the session's dtype; for rigid bodies with a pose, their reference
  /// shapes.
  std::string_view positions() const { return own_ ? std::string_view(*own_) : positions_.view(); }
  /// As Collider::positions() and poses().
  std::vector<double> placed() const;
  std::vector<BodyPose> poses() const;
  /// Writes the scene's description, except faces, edges, positions and arrays of filters, into the header.
  void describe(v1::SessionHeader& header) const;

  /// Is it a frame of all positions, of the session's type and number?
  bool gives_all(const Frame& frame) const;
  /// A frame's bytes. kInvalidArgument for positions of another type or number than the session's, and for
  /// unknown bodies. All positions are put into the region, if there is one and it has room.
  Result<SentFrame> encode(const Frame& frame, SharedRegion* region = nullptr) const;
  /// The frame was answered: everything is where it says, or up to `fraction` of the way there, as
  /// Collider::commit() puts it.
  void take(const SentFrame& frame, double fraction = 1);

  /// The request for a change of the scene; kInvalidArgument for a body that there is not, and for positions
  /// of another type or number than it needs. kFailedPrecondition if a body at a pose becomes non-rigid in a
  /// float32 session: its vertex positions are not known in float32.
  Result<v1::SceneChange> encode(const SceneEdit& edit) const;
  /// The daemon has carried the change out: what it makes of the scene.
  void take(SceneEdit edit);

 private:
  SceneState(const SceneState& of, std::string own)
      : scene_(of.scene_), float32_(of.float32_), own_(std::move(own)), poses_(of.poses_) {}

  std::size_t number_size() const { return float32_ ? sizeof(float) : sizeof(double); }
  Status check_kind(const Positions& positions, std::size_t vertices, const std::string& where) const;
  void take_all(const FrameBytes& positions);
  /// Moves vertices from where they are, in the body's pose, to the rows in `bytes`, up to `fraction` of the
  /// way.
  void move_rows(std::uint32_t first, const char* bytes, std::size_t vertices,
                 const std::optional<Pose>& pose, double fraction);
  template <class Real>
  void move_part_way(std::uint32_t first, const char* bytes, std::size_t vertices,
                     const std::optional<Pose>& pose, double fraction);
  Status check_index(std::uint32_t index) const;

  // Changes of the scene, by kind (scene_changes.cpp).
  Result<v1::SceneChange> request_for(const PutBody& put) const;
  Result<v1::SceneChange> request_for(const ReplaceElements& replacement) const;
  Result<v1::SceneChange> request_for(const ChangeBody& change) const;
  Result<v1::SceneChange> request_for(const ChangeFilters& change) const;
  Result<v1::SceneChange> request_for(const ChangeExcludedPairs& change) const;
  void apply(PutBody&& put);
  void apply(ReplaceElements&& replacement);
  void apply(ChangeBody&& change);
  void apply(ChangeFilters&& change) { scene_.filters = std::move(change.filters); }
  void apply(ChangeExcludedPairs&& change) { scene_.excluded_pairs = std::move(change.pairs); }
  /// The mesh of a body behind all others, whose vertices count from 0.
  void append_mesh(const std::vector<std::array<std::int32_t, 3>>& faces,
                   const std::vector<std::array<std::int32_t, 2>>& edges);
  /// Faces and edges are of bodies in their order, and these of one of them; it has `count` vertices from now
  /// on.
  void replace_mesh(std::uint32_t index, std::uint32_t count,
                    const std::vector<std::array<std::int32_t, 3>>& faces,
                    const std::vector<std::array<std::int32_t, 2>>& edges);

  /// Thickness of 0 everywhere is none, as in the engine: a daemon is told of what it has to know alone.
  void forget_zero_thickness();
  /// The positions, for writing: a frame's own are copied first.
  std::string& own_positions();

  SceneDescription scene_;
  bool float32_;
  FrameBytes positions_;                    // of the upload or of the last frame with all, ...
  std::optional<std::string> own_;          // ... unless they were changed since
  std::vector<std::optional<Pose>>
      poses_;  // by body: rigid bodies that last moved by poses; removed ones too
};

}  // namespace warmfront::client
