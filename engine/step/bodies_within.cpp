// SPDX-License-Identifier: Apache-2.0
#include "engine/step/bodies_within.h"

#include <utility>

#include "engine/step/warm_scene.h"

namespace warmfront {

std::optional<std::vector<std::uint32_t>> bodies_within(std::shared_ptr<const Scene> scene,
                                                        std::span<const double> positions, double distance,
                                                        std::shared_ptr<Workers> workers, StopSignal stop) {
  ColliderOptions options;
  options.min_separation = distance;
  options.find_bodies = options.find_rigid = false;
  options.bounds = BoundsKind::kKDop18;
  options.front = FrontMode::kNone;
  options.max_contacts = 1'000'000;
  Result<WarmScene> made = WarmScene::create(scene, positions, options, std::move(workers), stop);
  if (!made) return std::nullopt;
  const Result<StepResult> step = made.value().step(positions, stop);
  if (!step) return std::nullopt;
  std::vector<std::uint32_t> bodies;
  for (const Contact& contact : step.value().contacts)
    bodies.push_back(scene->body_of_vertex()[scene->vertices_of(contact)[0]]);
  return bodies;
}

}  // namespace warmfront
