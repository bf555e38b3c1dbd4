// SPDX-License-Identifier: Apache-2.0
// What a session needs to be created again where it was: its scene, and where everything is. Used by one
// thread at a time.
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

/// A frame as it travels: the fields of v1::StepFrame.
struct SentFrame {
  std::uint64_t number = 0;
  std::shared_ptr<const std::string> positions;  ///< all of them, which messages under way refer to, ...
  std::optional<v1::MovedParts> moved;           ///< ... or what moved
  // What it cost so far.
  double encode_ms = 0;
  std::uint64_t sent_bytes = 0;
};

class SceneState {
 public:
  /// `positions` of float32 or float64 are those of the first frame; the session's from then on are alike.
  SceneState(SceneDescription scene, const Positions& positions);
  SceneState(SceneState&&) = default;  // and no copy: two would write to one string of positions

  const SceneDescription& scene() const { return scene_; }
  bool float32() const { return float32_; }
  /// The upload's positions: (n, 3) in the session's dtype; of rigid bodies with a pose, their rest shapes.
  const std::string& positions() const { return *positions_; }
  /// Puts what there is to say of the scene into the header, the faces and positions apart.
  void describe(v1::SessionHeader& header) const;

  /// A frame's bytes. kInvalidArgument for positions of another kind or number than the session's, and for
  /// bodies that are not there.
  Result<SentFrame> encode(const Frame& frame) const;
  /// The frame was answered: everything is where it says.
  void take(const SentFrame& frame);

  /// The requests for these changes, and what they make of the state once they are carried out.
  Result<v1::SceneChange> encode(const BodyAddition& addition, const Positions& positions) const;
  void take(BodyAddition addition, const Positions& positions);
  /// kFailedPrecondition for a body that is at a pose and would be rigid no more, in a session of float32:
  /// where its vertices are is not known in float32.
  Status check_change(std::uint32_t index, const Body& body) const;
  void take(std::uint32_t index, Body body);

 private:
  std::size_t number_size() const { return float32_ ? sizeof(float) : sizeof(double); }
  Status check_kind(const Positions& positions, std::size_t vertices, const std::string& where) const;
  void put_rows(std::uint32_t first, const char* bytes, std::size_t vertices);
  /// The positions, for writing: a frame's own are copied first.
  std::string& own_positions();

  SceneDescription scene_;
  bool float32_;
  std::shared_ptr<const std::string> positions_;  // of the upload or of the frame that gave all, ...
  std::shared_ptr<std::string> own_;              // ... or the same string, where none has it but this
  std::vector<std::optional<Pose>> poses_;        // by body, of rigid bodies that moved by poses last
};

}  // namespace warmfront::client
