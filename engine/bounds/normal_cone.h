// SPDX-License-Identifier: Apache-2.0
// Normal cone and contour test: when a patch of surface provably cannot meet itself during a step. Pure
// function. Source: Volino, Magnenat-Thalmann 1994 (the theorem); Tang, Curtis, Yoon, Manocha 2008
// (continuous cones); star-shaped contour as in Wang, Liu, Liu, Tang, Manocha 2017; reference/algorithms 2.1
// and 2.2.
#pragma once

#include <cstdint>
#include <span>

#include "engine/motion/motion.h"
#include "engine/scene.h"

namespace warmfront {

/// True only if, at every t in [0, 1], the patch is a graph over the plane normal to one axis, so that no two
/// of its faces that share no vertex meet. `patch` must be connected through consistently oriented manifold
/// edges and have the single closed `contour` (scene/patches.h). Says nothing about distances: not for use
/// with a minimum separation.
///
/// Proof. (1) All face normals have a positive component along the axis at all times: each normal is a
/// quadratic Bezier, its three controls are tested. So projection along the axis keeps every face's
/// orientation. (2) Seen from the contour's centroid every contour edge turns counter-clockwise at all times
/// (again three Bezier coefficients), and at t = 0, hence at all times, the contour winds around once: it is
/// a simple closed curve J. The projection of an oriented surface whose faces all keep their orientation
/// covers each point as often as its boundary winds around it: once inside J, never outside. So it is one to
/// one.
///
/// Every sign must exceed its error bound: with difference vectors of relative error u, a triple product of
/// coordinates bounded by A, B and an axis bounded by 1 has 6 products of 7 roundings, 42 u A B; coefficients
/// that average two have the same bound. 64 u A B is used, and 2^-900 for underflow.
bool provably_embedded(const Scene& scene, std::span<const VertexMotion> vertices,
                       std::span<const std::uint32_t> patch, std::span<const std::uint32_t> contour);

}  // namespace warmfront
