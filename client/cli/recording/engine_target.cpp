// SPDX-License-Identifier: Apache-2.0
// Replaying through the engine itself. Thread safety as stated in replay_target.h.
#include <cstring>
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
    if (change.has_replace_elements()) {
      auto faces = faces_of(change.replace_elements().faces(), "replace_elements.faces");
      if (!faces) return faces.error();
      auto edges = edges_of(change.replace_elements().edges(), "replace_elements.edges");
      if (!edges) return edges.error();
      return SceneChange(ReplaceElements{change.replace_elements().index(), std::move(faces).value(),
                                         std::move(edges).value()});
    }
    if (change.has_replace_body()) {
      Result<AddBody> with = body_of(change.replace_body().with(), "replace_body.with");
      if (!with) return with.error();
      return SceneChange(ReplaceBody{change.replace_body().index(), std::move(with.value().addition),
                                     std::move(with.value().positions)});
    }
    if (change.has_change()) {
      Result<Body> body = wire::body_from(change.change().body(), "body");
      if (!body) return body.error();
      return SceneChange(ChangeBody{change.change().index(), std::move(body).value()});
    }
    if (!change.has_add()) return invalid_argument("a change of a kind that this program does not know");
    Result<AddBody> add = body_of(change.add(), "add");
    if (!add) return add.error();
    return SceneChange(std::move(add).value());
  }

  Result<AddBody> body_of(const v1::BodyAddition& message, const std::string& where) const {
    Result<Body> body = wire::body_from(message.body(), where + ".body");
    if (!body) return body.error();
    auto faces = faces_of(message.faces(), where + ".faces");
    if (!faces) return faces.error();
    const auto positions =
        positions_of(message.positions(), float32_, body.value().vertex_count, where + ".positions");
    if (!positions) return positions.error();
    auto edges = edges_of(message.edges(), where + ".edges");
    if (!edges) return edges.error();
    AddBody add{{std::move(body).value(), std::move(faces).value(), std::move(edges).value()}, {}};
    const std::string& thickness = message.thickness();
    if (thickness.size() % sizeof(double) != 0)
      return invalid_argument(where + ".thickness: is no whole number of float64");
    add.addition.thickness.resize(thickness.size() / sizeof(double));
    if (!thickness.empty()) std::memcpy(add.addition.thickness.data(), thickness.data(), thickness.size());
    std::visit([&](const auto& values) { add.positions.assign(values.begin(), values.end()); },
               positions.value());
    return add;
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
