// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/primitives.h"

namespace warmfront {

Face primitive_vertices(const Scene& scene, Primitive primitive) {
  if ((primitive & kPoint) == 0) return scene.faces()[primitive];
  const std::uint32_t v = primitive & ~kPoint;
  return {v, v, v};
}

}  // namespace warmfront
