// SPDX-License-Identifier: Apache-2.0
// Oracle for reduced answers of proximity: groups all rows by the vertices of their closest features, one row
// after the other, with none of the engine's numbers of edges and in long double. Pure function.
#pragma once

#include <span>
#include <vector>

#include "engine/contact.h"
#include "engine/motion/motion.h"
#include "engine/scene.h"

namespace warmfront::testing {

struct ReducedOracle {
  std::vector<Contact> contacts;
  std::vector<ClosestPair> closest_pairs;
};

/// `all`: the rows of the answer that is not reduced, at `vertices`, in the scene's numbers.
ReducedOracle reduced_oracle(const Scene& scene, std::span<const VertexMotion> vertices,
                             std::span<const Contact> all);

}  // namespace warmfront::testing
