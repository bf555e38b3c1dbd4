// SPDX-License-Identifier: Apache-2.0
// Scenes and positions as Eigen matrices (V and F, as simulations hold them). Views; positions are not
// copied. Include it only where Eigen is available. Pure functions.
#pragma once

#include <Eigen/Core>
#include <span>

#include "engine/collider.h"
#include "engine/scene.h"

namespace warmfront {

/// (n, 3) vertex positions, a row each.
template <class Real>
using VertexMatrix = Eigen::Matrix<Real, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// (m, 3) vertex indices, a triangle a row.
using FaceMatrix = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// A view of the positions; valid as long as `vertices` is.
template <class Real>
Positions positions_of(const VertexMatrix<Real>& vertices) {
  return std::span<const Real>(vertices.data(), static_cast<std::size_t>(vertices.size()));
}

/// A description with these faces over `vertices.rows()` vertices; bodies default to the connected
/// components.
template <class Real>
SceneDescription describe(const VertexMatrix<Real>& vertices, const FaceMatrix& faces) {
  SceneDescription description;
  description.vertex_count = static_cast<std::uint32_t>(vertices.rows());
  description.faces.reserve(static_cast<std::size_t>(faces.rows()));
  for (const auto& row : faces.rowwise()) description.faces.push_back({row[0], row[1], row[2]});
  return description;
}

}  // namespace warmfront
