// SPDX-License-Identifier: Apache-2.0
// The stepper over the engine itself. Thread safety as stated in stepper.h.
#include <utility>
#include <variant>
#include <vector>

#include "client/cli/detect/stepper.h"

namespace warmfront::client {
namespace {

class LocalStepper final : public Stepper {
 public:
  LocalStepper(Collider collider, int threads) : collider_(std::move(collider)), threads_(threads) {}

  Result<StepAnswer> step(const Frame& frame) override {
    Result<StepResult> result = collider_.step(frame);
    if (!result) return result.error();
    const StepResult& step = result.value();
    StepAnswer answer{step.vf, step.ee, step.vh,         step.possible,      step.earliest_toi,
                      {},      {},      step.statistics, step.all_deformable};
    answer.contacts.reserve(step.contacts.size());
    for (const Contact& contact : step.contacts)
      answer.contacts.push_back(
          {contact.kind, contact.status, collider_.scene().vertices_of(contact), contact.toi});
    answer.geometry.assign(step.geometry.begin(), step.geometry.end());
    return answer;
  }

  Status replace(std::vector<ReplacedBody> bodies, const Positions& positions) override {
    std::vector<SceneChange> changes;
    for (ReplacedBody& body : bodies) {
      const Positions own = rows_of(positions, body.first_vertex, body.with.body.vertex_count);
      std::vector<double> rows;
      std::visit([&rows](auto values) { rows.assign(values.begin(), values.end()); }, own);
      changes.push_back(ReplaceBody{body.index, std::move(body.with), std::move(rows)});
    }
    if (Status status = collider_.change(std::move(changes)); !status) return status;
    return place(Frame(positions));
  }

  Status place(const Frame& frame) override { return collider_.place(frame); }

  int threads() const override { return threads_; }

 private:
  Collider collider_;
  int threads_;
};

}  // namespace

Result<std::unique_ptr<Stepper>> make_local_stepper(const SceneDescription& description,
                                                    const Positions& positions,
                                                    const ColliderOptions& options, int threads) {
  Result<Scene> scene = Scene::create(description);
  if (!scene) return scene.error();
  auto workers = std::make_shared<Workers>(threads);
  Result<Collider> collider =
      Collider::create(std::make_shared<const Scene>(std::move(scene).value()), positions, options, workers);
  if (!collider) return collider.error();
  return std::unique_ptr<Stepper>(
      std::make_unique<LocalStepper>(std::move(collider).value(), workers->threads()));
}

}  // namespace warmfront::client
