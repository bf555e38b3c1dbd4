// SPDX-License-Identifier: Apache-2.0
// The state needed to create a session again: its scene and all current positions. Used by one thread at a
// time.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/frame.h"
#include "engine/question.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

class PendingAnswer;

/// A frame as it travels: the fields of v1::StepFrame, or of v1::Commit.
struct SentFrame {
  std::uint64_t number = 0;
  Question question = {};
  std::optional<double> commit = std::nullopt;  ///< of the trial before, up to this fraction: no positions
  /// A trial that was answered, sent again for the commit after it: nobody waits for its answer.
  bool answered = false;
  std::shared_ptr<const std::string> positions;    ///< all of them, which messages under way refer to, ...
  std::optional<v1::MovedParts> moved;             ///< ... or what moved
  std::shared_ptr<PendingAnswer> asked = nullptr;  ///< who gets the answer
  // Cost so far.
  double encode_ms = 0;
  std::uint64_t sent_bytes = 0;

  /// Else the session stays where it is.
  bool counts() const { return commit || question.counts(); }
  /// A trial that may be committed, and what is about the last of them.
  bool is_trial() const {
    return !commit && (question.kind == QuestionKind::kTrial || question.kind == QuestionKind::kMaxStep);
  }
  bool needs_trial() const { return commit || (question.of_state() && question.where == Where::kTrialEnd); }
};

class SceneState {
 public:
  /// `positions` are those of the first frame; the session then uses their type, float32 or float64. They are
  /// the rest shape where the filters need one and have none.
  SceneState(SceneDescription scene, const Positions& positions);
  SceneState(SceneState&&) = default;  // not copyable: two would write to one string of positions

  const SceneDescription& scene() const { return scene_; }
  bool float32() const { return float32_; }
  /// The upload's positions: (n, 3) in the session's dtype; for rigid bodies with a pose, their reference
  /// shapes.
  const std::string& positions() const { return *positions_; }
  /// Writes the scene's description, except faces, edges, positions and arrays of filters, into the header.
  void describe(v1::SessionHeader& header) const;

  /// A frame's bytes. kInvalidArgument for positions of another type or number than the session's, and for
  /// unknown bodies.
  Result<SentFrame> encode(const Frame& frame) const;
  /// The frame was answered: everything is where it says, or up to `fraction` of the way there, as
  /// Collider::commit() puts it.
  void take(const SentFrame& frame, double fraction = 1);

  /// Requests for these changes, and their effect on the state after the daemon has carried them out.
  Result<v1::SceneChange> encode(const BodyAddition& addition, const Positions& positions) const;
  void take(BodyAddition addition, const Positions& positions);
  /// kFailedPrecondition if a body at a pose becomes non-rigid in a float32 session: its vertex positions are
  /// not known in float32.
  Status check_change(std::uint32_t index, const Body& body) const;
  void take(std::uint32_t index, Body body);
  void take(PairFilters filters) { scene_.filters = std::move(filters); }
  void take_excluded_pairs(std::vector<std::array<std::uint32_t, 2>> pairs) {
    scene_.excluded_pairs = std::move(pairs);
  }
  Result<v1::SceneChange> encode(const ReplaceElements& replacement) const;
  void take(ReplaceElements replacement);
  Result<v1::SceneChange> encode(std::uint32_t index, const BodyAddition& with,
                                 const Positions& positions) const;
  void take(std::uint32_t index, BodyAddition with, const Positions& positions);

 private:
  std::size_t number_size() const { return float32_ ? sizeof(float) : sizeof(double); }
  Status check_kind(const Positions& positions, std::size_t vertices, const std::string& where) const;
  /// Moves vertices from where they are, in the body's pose, to the rows in `bytes`, up to `fraction` of the
  /// way.
  void move_rows(std::uint32_t first, const char* bytes, std::size_t vertices,
                 const std::optional<Pose>& pose, double fraction);
  template <class Real>
  void move_part_way(std::uint32_t first, const char* bytes, std::size_t vertices,
                     const std::optional<Pose>& pose, double fraction);
  Status check_index(std::uint32_t index) const;
  Result<v1::BodyAddition> encode_body(const BodyAddition& body, const Positions& positions) const;
  /// Faces and edges are of bodies in their order, and these of one of them; it has `count` vertices from now
  /// on.
  void replace_mesh(std::uint32_t index, std::uint32_t count,
                    const std::vector<std::array<std::int32_t, 3>>& faces,
                    const std::vector<std::array<std::int32_t, 2>>& edges);
  /// The positions, for writing: a frame's own are copied first.
  std::string& own_positions();

  SceneDescription scene_;
  bool float32_;
  std::shared_ptr<const std::string> positions_;  // of the upload or of the last frame with all, ...
  std::shared_ptr<std::string> own_;              // ... or the same string, if it is not shared
  std::vector<std::optional<Pose>> poses_;        // by body: rigid bodies that last moved by poses
};

}  // namespace warmfront::client
