// SPDX-License-Identifier: Apache-2.0
#include "engine/all_deformable.h"

#include <new>
#include <utility>
#include <vector>

namespace warmfront {
namespace {

// The scene without its model. With removed bodies it keeps the ranges, so that these stay out.
Scene plain(const Scene& scene) {
  std::vector<Body> bodies;
  bool removed = false;
  for (const Body& body : scene.bodies()) {
    bodies.push_back({"", body.first_vertex, body.vertex_count});
    if (body.kind != BodyKind::kRemoved) continue;
    bodies.back().kind = BodyKind::kRemoved;
    removed = true;
  }
  if (!removed) bodies.clear();
  return scene.with_bodies(std::move(bodies)).value();
}

}  // namespace

void AllDeformable::begin(const Collider& collider, const std::atomic<bool>* cancelled) {
  if (collider_) return;
  ColliderOptions options = collider.options();
  options.explain = options.find_bodies = options.find_rigid = false;
  if (options.bounds == BoundsKind::kAuto) options.bounds = BoundsKind::kKDop18;
  const std::vector<double> positions = collider.positions();
  Result<Collider> made = Collider::create(std::make_shared<const Scene>(plain(collider.scene())),
                                           std::span<const double>(positions), options, workers_, cancelled);
  if (made) collider_.emplace(std::move(made).value());
}

std::optional<StepStatistics> AllDeformable::follow(const Collider& collider,
                                                    const std::atomic<bool>* cancelled) {
  if (!collider_) return std::nullopt;
  // The collider's step is made and stays so, whatever becomes of this one.
  try {
    const std::vector<double> positions = collider.positions();
    const Result<StepResult> step = collider_->step(std::span<const double>(positions), cancelled);
    if (step) return step.value().statistics;
  } catch (const std::bad_alloc&) {
  }
  forget();
  return std::nullopt;
}

}  // namespace warmfront
