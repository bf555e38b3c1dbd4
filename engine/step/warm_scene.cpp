// SPDX-License-Identifier: Apache-2.0
#include "engine/step/warm_scene.h"

#include <utility>
#include <variant>
#include <vector>

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

}  // namespace warmfront
