// SPDX-License-Identifier: Apache-2.0
// Which bodies of a scene at rest come near themselves or each other. Thread-safe.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "engine/stop.h"
#include "engine/workers.h"

namespace warmfront {

/// See BodiesWithin in rigid_parts.h. The bodies of each contact's first vertex.
std::optional<std::vector<std::uint32_t>> bodies_within(std::shared_ptr<const Scene> scene,
                                                        std::span<const double> positions, double distance,
                                                        std::shared_ptr<Workers> workers, StopSignal stop);

}  // namespace warmfront
