// SPDX-License-Identifier: Apache-2.0
#include "engine/step/all_deformable.h"

#include <new>
#include <utility>
#include <vector>

namespace warmfront {
namespace {

// The scene without its model, and without half-spaces. With removed or thick bodies it keeps the ranges, so
// that these stay so.
Scene plain(const Scene& scene) {
  std::vector<Body> bodies;
  bool ranges_matter = false;
  for (const Body& body : scene.bodies()) {
    if (body.half_space) continue;
    bodies.push_back({"", body.first_vertex, body.vertex_count});
    bodies.back().thickness = body.thickness;
    const bool removed = body.kind == BodyKind::kRemoved;
    if (removed) bodies.back().kind = BodyKind::kRemoved;
    ranges_matter |= removed || body.thickness > 0;
  }
  if (!ranges_matter) bodies.clear();
  return scene.with_bodies(std::move(bodies)).value();
}

}  // namespace

void AllDeformable::begin(const Core& core, StopSignal stop) try {
  if (scene_) return;
  ColliderOptions options = core.options;
  options.explain = options.find_bodies = options.find_rigid = false;
  if (options.bounds == BoundsKind::kAuto) options.bounds = BoundsKind::kKDop18;
  const std::vector<double> positions = core.motion.positions();
  Result<WarmScene> made = WarmScene::create(std::make_shared<const Scene>(plain(*core.scene)),
                                             std::span<const double>(positions), options, workers_, stop);
  if (made) scene_.emplace(std::move(made).value());
} catch (const Stopped&) {  // so is the step
}

std::optional<StepStatistics> AllDeformable::follow(const Core& core, StopSignal stop) {
  if (!scene_) return std::nullopt;
  // The step of the core is made and stays so, whatever becomes of this one.
  try {
    const std::vector<double> positions = core.motion.positions();
    const Result<StepResult> step = scene_->step(std::span<const double>(positions), stop);
    if (step) return step.value().statistics;
  } catch (const std::bad_alloc&) {
  }
  forget();
  return std::nullopt;
}

}  // namespace warmfront
