// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/worlds.h"

namespace warmfront {

Worlds::Worlds(const Scene& scene, StopSignal stop) {
  const std::span<const Body> bodies = scene.bodies();
  PacedStop paced(stop);
  const auto counts = [&](const Body& body) {
    paced.check();
    return body.kind != BodyKind::kRemoved;
  };
  if (std::ranges::none_of(bodies, [&](const Body& body) { return counts(body) && body.world != 0; })) return;
  numbers_.reserve(bodies.size());
  for (const Body& body : bodies) {
    if (counts(body)) numbers_.push_back(body.world);
  }
  const auto ascending = [&](std::uint32_t a, std::uint32_t b) {
    paced.check();
    return a < b;
  };
  std::ranges::sort(numbers_, ascending);
  numbers_.erase(std::unique(numbers_.begin(), numbers_.end()), numbers_.end());
  of_body_.reserve(bodies.size());
  for (const Body& body : bodies) {
    const auto at = std::ranges::lower_bound(numbers_, body.world, ascending);
    of_body_.push_back(static_cast<std::uint32_t>(at - numbers_.begin()));  // of a removed one unused
  }
}

}  // namespace warmfront
