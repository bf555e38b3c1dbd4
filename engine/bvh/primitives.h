// SPDX-License-Identifier: Apache-2.0
// What a hierarchy holds: faces, and isolated vertices as points. Pure functions.
#pragma once

#include "engine/scene.h"

namespace warmfront {

/// The vertices of a primitive; an isolated vertex stands three times.
Face primitive_vertices(const Scene& scene, Primitive primitive);

}  // namespace warmfront
