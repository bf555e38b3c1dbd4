// SPDX-License-Identifier: Apache-2.0
// Replaying through the engine itself. Thread safety as stated in replay_target.h.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/recording/from_wire.h"
#include "client/cli/recording/replay_target.h"
#include "engine/contact_hash.h"
#include "proto/wire/question.h"
#include "proto/wire/scene_change.h"

namespace warmfront::client {
namespace {

class EngineTarget final : public ReplayTarget {
 public:
  EngineTarget(Collider collider, bool float32) : collider_(std::move(collider)), float32_(float32) {}

  Result<AnswerDigest> step(const RecordedStep& step) override {
    if (step.commit) return commit(step.commit->fraction());
    Question question;
    if (step.parts.front().has_question()) {
      const Result<Question> asked = wire::question_from(step.parts.front().question());
      if (!asked) return asked.error();
      question = asked.value();
    }
    question.rounding = rounding();
    const Result<WireFrame> frame = WireFrame::read(step.parts, float32_, collider_.scene());
    if (!frame) return frame.error();
    const Result<StepResult> result = collider_.ask(frame.value().frame(), question);
    if (!result) return result.error();
    const StepResult& answer = result.value();
    ContactHash hash;
    hash.add_step(collider_.scene(), answer.contacts);
    hash.add_distances(answer.vertex_distances);
    for (const ClosestPair& pair : answer.closest_pairs) hash.add_closest_pair(pair);
    return AnswerDigest{answer.vf, answer.ee, answer.possible, answer.earliest_toi, hash.value(), answer.vh};
  }

  Status change(const v1::ChangeSceneRequest& request) override {
    std::vector<SceneChange> changes;
    for (int i = 0; i < request.changes_size(); ++i) {
      Result<SceneChange> change =
          wire::change_from(request.changes(i), float32_, "changes[" + std::to_string(i) + "]");
      if (!change) return change.error();
      changes.push_back(std::move(change).value());
    }
    std::optional<ColliderOptions> options;
    if (request.has_options()) {
      Result<ColliderOptions> read = options_of(request.options());
      if (!read) return read.error();
      options = read.value();
    }
    return collider_.change(std::move(changes), nullptr, nullptr, options);  // all of them or none
  }

 private:
  Rounding rounding() const { return float32_ ? Rounding::kFloat32 : Rounding::kFloat64; }
  Result<AnswerDigest> commit(double fraction) {
    const Result<CommitResult> result = collider_.commit(fraction, rounding());
    if (!result) return result.error();
    ContactHash nothing;
    nothing.begin_step(0);
    return AnswerDigest{result.value().vf.value_or(0),
                        result.value().ee.value_or(0),
                        result.value().possible.value_or(0),
                        result.value().earliest_toi,
                        nothing.value(),
                        result.value().vh.value_or(0)};
  }

  Collider collider_;
  const bool float32_;
};

}  // namespace

Result<std::unique_ptr<ReplayTarget>> make_engine_target(const RecordedSession& recorded, int threads) {
  Result<Scene> scene = Scene::create(recorded.scene());
  if (!scene) return scene.error();
  Result<Collider> collider =
      Collider::create(std::make_shared<const Scene>(std::move(scene).value()), view(recorded.positions()),
                       recorded.options(), std::make_shared<Workers>(threads));
  if (!collider) return collider.error();
  if (Status placed = collider.value().place(recorded.poses()); !placed) return placed.error();
  return std::unique_ptr<ReplayTarget>(
      std::make_unique<EngineTarget>(std::move(collider).value(), recorded.float32()));
}

}  // namespace warmfront::client
