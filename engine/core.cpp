// SPDX-License-Identifier: Apache-2.0
#include "engine/core.h"

#include <utility>

#include "engine/self_check.h"

namespace warmfront {

std::vector<double> to_doubles(const Positions& positions) {
  std::vector<double> values;
  std::visit([&](auto span) { values.assign(span.begin(), span.end()); }, positions);
  return values;
}

Core::Core(std::shared_ptr<const Scene> the_scene, const Scene& modelled, const Positions& positions,
           const ColliderOptions& the_options, std::shared_ptr<Workers> the_workers)
    : scene(std::move(the_scene)),
      options(the_options),
      workers(std::move(the_workers)),
      motion(modelled, to_doubles(positions)),
      model(modelled) {
  // The cone theorem rules out meeting, not nearness.
  const bool cones = options.normal_cones && options.min_separation == 0;
  workers->run([&] {
    topology = std::make_unique<Topology>(modelled, motion.vertices(), options.leaf_size, cones);
    motion.renumber(topology->numbering);
    motion.vertices().hold(motion.vertices().frame().to_local(options.min_separation));
    take_parts(modelled);
  });
}

void Core::take_parts(const Scene& modelled) {
  model = CollisionModel(modelled);
  rigid_parts.take_parts(model);
  excluded_pairs = model.excluded_pairs();
  vertex_bounds.resize(scene->vertex_count());
  patch_culled.resize(topology->patches.count());
  orphans.resize(topology->parts.size());
  for (std::uint32_t p = 0; p < orphans.size(); ++p) {
    if (!model.self_collision(p)) {
      orphans[p].reset();
    } else if (orphans[p] == nullptr) {
      topology->need_adjacent(p);
      orphans[p] = std::make_unique<OrphanBlocks>(topology->scene, topology->parts[p].orphans);
    }
  }
  checksum = warmfront::checksum(*this);
}

}  // namespace warmfront
