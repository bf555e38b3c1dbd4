// SPDX-License-Identifier: Apache-2.0
#include "engine/step/warm_scene.h"

#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "engine/motion/check_positions.h"
#include "engine/scene/found_bodies.h"
#include "engine/step/auto_bounds.h"

namespace warmfront {
namespace {

// The scene, with the bodies that are found where it declares none.
std::shared_ptr<const Scene> model_of(std::shared_ptr<const Scene> scene, const ColliderOptions& options,
                                      StopSignal stop) {
  if (!options.find_bodies || !scene->bodies().empty()) return scene;
  std::vector<Body> bodies = found_bodies(*scene, stop);
  if (bodies.empty()) return scene;
  return std::make_shared<const Scene>(scene->with_bodies(std::move(bodies), stop).value());
}

Status check_all(const Positions& positions, std::uint32_t vertex_count, StopSignal stop) {
  return std::visit([&](auto values) { return check_positions(values, vertex_count, "positions", stop); },
                    positions);
}

// Do they ask for the same contacts, told in the same way?
bool ask_alike(const ColliderOptions& a, const ColliderOptions& b) {
  const auto of = [](const ColliderOptions& o) {
    return std::tie(o.tier, o.tolerance, o.min_separation, o.report, o.leave_out_overlaps);
  };
  return of(a) == of(b);
}

}  // namespace

Result<WarmScene> WarmScene::create(std::shared_ptr<const Scene> scene, const Positions& positions,
                                    const ColliderOptions& options, std::shared_ptr<Workers> workers,
                                    StopSignal stop) {
  if (Status status = validate(options); !status) return status.error();
  if (Status status = check_hubs(*scene, stop); !status) return status.error();
  if (Status status = check_all(positions, scene->vertex_count(), stop); !status) return status.error();
  const std::shared_ptr<const Scene> modelled = model_of(scene, options, stop);
  Core core(std::move(scene), *modelled, positions, options, std::move(workers), stop);
  return WarmScene{std::move(core), options.bounds == BoundsKind::kAuto ? make_auto_pipeline()
                                                                        : make_pipeline(options.bounds)};
}

Result<StepResult> WarmScene::ask(const Frame& frame, Kind kind, const ColliderOptions& options,
                                  StopSignal stop, const AcceptStep& accept) {
  if (Status status = validate(options); !status) return status.error();
  if (options.min_separation > core.bounds_separation) {
    const LocalTransform& local = core.motion.vertices().frame();
    const double more = local.to_local(options.min_separation) - local.to_local(core.bounds_separation);
    core.widen_bounds(options.min_separation);
    pipeline->bounds_widened(more / 2);
  }
  if (!ask_alike(options, asked)) pipeline->options_changed(core);
  asked = options;
  struct Restored {
    explicit Restored(ColliderOptions& of_core) : options(of_core), before(of_core) {}
    ~Restored() { options = before; }
    ColliderOptions& options;
    const ColliderOptions before;
  } const restored(core.options);
  core.options = options;
  core.asked_separation = options.min_separation;
  return pipeline->step(core, frame, kind, stop, accept);
}

void WarmScene::drop_trial() noexcept {
  if (core.motion.trial()) pipeline->commit(core, 0, Rounding::kFloat64);
}

}  // namespace warmfront
