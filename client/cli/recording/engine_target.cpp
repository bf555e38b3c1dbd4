// SPDX-License-Identifier: Apache-2.0
// Replaying through the engine itself. Thread safety as stated in replay_target.h.
#include <utility>

#include "client/cli/recording/from_wire.h"
#include "client/cli/recording/replay_target.h"
#include "engine/contact_hash.h"
#include "proto/wire/filters.h"
#include "proto/wire/question.h"
#include "proto/wire/scene.h"

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
    for (const v1::SceneChange& message : request.changes()) {
      Result<SceneChange> change = change_of(message);
      if (!change) return change.error();
      changes.push_back(std::move(change).value());
    }
    return collider_.change(std::move(changes));  // all of them or none
  }

 private:
  Result<AnswerDigest> commit(double fraction) {
    const Result<CommitResult> result =
        collider_.commit(fraction, float32_ ? Rounding::kFloat32 : Rounding::kFloat64);
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

  Result<SceneChange> change_of(const v1::SceneChange& change) const {
    if (change.has_change_filters()) {
      Result<PairFilters> filters = wire::filters_from(change.change_filters(), "change_filters");
      if (!filters) return filters.error();
      return SceneChange(ChangeFilters{std::move(filters).value()});
    }
    if (!change.has_add() && !change.has_change())
      return invalid_argument("a change of a kind that this program does not know");
    Result<Body> body =
        wire::body_from(change.has_add() ? change.add().body() : change.change().body(), "body");
    if (!body) return body.error();
    if (change.has_change()) return SceneChange(ChangeBody{change.change().index(), std::move(body).value()});
    auto faces = faces_of(change.add().faces(), "add.faces");
    if (!faces) return faces.error();
    const auto positions =
        positions_of(change.add().positions(), float32_, body.value().vertex_count, "add.positions");
    if (!positions) return positions.error();
    auto edges = edges_of(change.add().edges(), "add.edges");
    if (!edges) return edges.error();
    AddBody add{{std::move(body).value(), std::move(faces).value(), std::move(edges).value()}, {}};
    std::visit([&](const auto& values) { add.positions.assign(values.begin(), values.end()); },
               positions.value());
    return SceneChange(std::move(add));
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
