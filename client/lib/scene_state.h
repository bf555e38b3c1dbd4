// SPDX-License-Identifier: Apache-2.0
// The state needed to create a session again: its scene and all current positions. Used by one thread at a
// time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/frame.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

/// A frame as sent: the fields of v1::StepFrame.
struct SentFrame {
  std::uint64_t number = 0;
  std::shared_ptr<const std::string> positions;  ///< all of them, shared with messages in flight, ...
  std::optional<v1::MovedParts> moved;           ///< ... or what moved
  // Cost so far.
  double encode_ms = 0;
  std::uint64_t sent_bytes = 0;
};

class SceneState {
 public:
  /// `positions` are those of the first frame; the session then uses their type, float32 or float64.
  SceneState(SceneDescription scene, const Positions& positions);
  SceneState(SceneState&&) = default;  // not copyable: two would write to one string of positions

  const SceneDescription& scene() const { return scene_; }
  bool float32() const { return float32_; }
  /// The upload's positions: (n, 3) in the session's dtype; for rigid bodies with a pose, their reference
  /// shapes.
  const std::string& positions() const { return *positions_; }
  /// Writes the scene's description, except faces and positions, into the header.
  void describe(v1::SessionHeader& header) const;

  /// A frame's bytes. kInvalidArgument for positions of another type or number than the session's, and for
  /// unknown bodies.
  Result<SentFrame> encode(const Frame& frame) const;
  /// Makes an answered frame's positions current.
  void take(const SentFrame& frame);

  /// Requests for these changes, and their effect on the state after the daemon has carried them out.
  Result<v1::SceneChange> encode(const BodyAddition& addition, const Positions& positions) const;
  void take(BodyAddition addition, const Positions& positions);
  /// kFailedPrecondition if a body at a pose becomes non-rigid in a float32 session: its vertex positions are
  /// not known in float32.
  Status check_change(std::uint32_t index, const Body& body) const;
  void take(std::uint32_t index, Body body);

 private:
  std::size_t number_size() const { return float32_ ? sizeof(float) : sizeof(double); }
  Status check_kind(const Positions& positions, std::size_t vertices, const std::string& where) const;
  void put_rows(std::uint32_t first, const char* bytes, std::size_t vertices);
  /// Writable positions: copied first if they are shared with a frame.
  std::string& own_positions();

  SceneDescription scene_;
  bool float32_;
  std::shared_ptr<const std::string> positions_;  // of the upload or of the last frame with all, ...
  std::shared_ptr<std::string> own_;              // ... or the same string, if it is not shared
  std::vector<std::optional<Pose>> poses_;        // by body: rigid bodies that last moved by poses
};

}  // namespace warmfront::client
