// SPDX-License-Identifier: Apache-2.0
#include "engine/step/warm_scene.h"

#include <algorithm>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "engine/motion/check_positions.h"
#include "engine/scene/found_bodies.h"
#include "engine/scene/screws.h"
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
    return std::tie(o.tier, o.tolerance, o.min_separation, o.report, o.leave_out_overlaps, o.keep_distance,
                    o.room_for, o.pair_test, o.instant);
  };
  return of(a) == of(b);
}

// What asks for the same in the pipeline's words. No number of a pair's own can be decided without error:
// that is left to the certified tier, in tier exact by a tolerance beneath what else is rounded.
ColliderOptions decided(ColliderOptions options) {
  constexpr double kFine = 0x1p-32;
  if (!options.keep_distance || options.tier != Tier::kExact) return options;
  options.tier = Tier::kCertified;
  options.tolerance = kFine;
  return options;
}

}  // namespace

Result<WarmScene> WarmScene::create(std::shared_ptr<const Scene> scene, const Positions& positions,
                                    const ColliderOptions& options, std::shared_ptr<Workers> workers,
                                    StopSignal stop) {
  if (Status status = validate(options); !status) return status.error();
  if (Status status = check_thickness(scene->most_thickness(), options); !status) return status.error();
  if (Status status = check_screws(screw_count(scene->bodies()) > 0, options); !status) return status.error();
  if (Status status = check_hubs(*scene, stop); !status) return status.error();
  if (Status status = check_rings(*scene, stop); !status) return status.error();
  if (Status status = check_all(positions, scene->vertex_count(), stop); !status) return status.error();
  const std::shared_ptr<const Scene> modelled = model_of(scene, options, stop);
  Core core(std::move(scene), *modelled, positions, options, std::move(workers), stop);
  return WarmScene{std::move(core), options.bounds == BoundsKind::kAuto ? make_auto_pipeline()
                                                                        : make_pipeline(options.bounds)};
}

Result<StepResult> WarmScene::ask(const Frame& frame, Kind kind, const ColliderOptions& given,
                                  StopSignal stop, const AcceptStep& accept) {
  if (Status status = validate(given); !status) return status.error();
  if (Status status = check_thickness(core.thickness.most(), given); !status) return status.error();
  if (Status status = check_screws(!core.model.screws().empty(), given); !status) return status.error();
  const ColliderOptions options = decided(given);
  if (!ask_alike(options, asked)) pipeline->options_changed(core);
  asked = options;
  struct Restored {
    explicit Restored(ColliderOptions& of_core) : options(of_core), before(of_core) {}
    ~Restored() { options = before; }
    ColliderOptions& options;
    const ColliderOptions before;
  } const restored(core.options);
  core.options = options;
  core.keep = {options.keep_distance.value_or(0), options.min_separation};
  if (!options.keep_distance && !options.room_for) core.asked_separation = options.min_separation;
  core.window.begin();
  if (!options.keep_distance) return pipeline->step(core, frame, kind, stop, accept);
  return ask_in_turns(frame, kind, stop, accept);
}

Result<StepResult> WarmScene::ask_in_turns(const Frame& frame, Kind kind, StopSignal stop,
                                           const AcceptStep& accept) {
  const AcceptStep accept_last = [&](const StepResult& result) {
    return core.window.narrowed() || !accept ? Status() : accept(result);
  };
  StageTimes before;
  while (true) {
    Result<StepResult> result = pipeline->step(core, frame, kind, stop, accept_last);
    if (!result) return result;
    StageTimes& ms = result.value().statistics.ms;
    for (double StageTimes::*stage : {&StageTimes::total, &StageTimes::refit, &StageTimes::front,
                                      &StageTimes::elementary, &StageTimes::adjacent})
      before.*stage = ms.*stage += before.*stage;
    if (!core.window.narrowed()) return result;
    const StepResult& first = result.value();
    const double toi = first.earliest_toi.value_or(2);
    core.window.next(first.world_tois.empty() ? std::span(&toi, 1) : first.world_tois);
  }
}

void WarmScene::drop_trial() noexcept {
  if (core.motion.trial()) pipeline->commit(core, 0, Rounding::kFloat64);
}

}  // namespace warmfront
