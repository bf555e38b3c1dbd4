// SPDX-License-Identifier: Apache-2.0
// Which pairs of features do not count, though their bodies may meet. Plain values.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/frame.h"
#include "engine/result.h"

namespace warmfront {

/// Pairs that no question tells of, nor tests. A pair (a vertex and a face, two edges, an edge and a face) is
/// left out when
///   - a vertex of one and a vertex of the other are at most `within_edges` edges of the mesh apart, or
///   - a vertex of one and a vertex of the other are one of `excluded_vertex_pairs`, or
///   - both are at most `near_at_rest` apart in the rest shape, or
///   - all their vertices have the same number, other than 0, in `patches`.
/// The first two ask for one pair of vertices because they extend what no pair has anyway: a common vertex,
/// which is 0 edges apart. So of n rings all is left out whose nearest vertices are n edges apart, and two
/// vertices that are sewn together are as one. The third asks for the features' own distance, which the
/// distances of their vertices do not bound: proximity(near_at_rest) of the rest shape, in tier exact, finds
/// these pairs, and with them left out none. The last asks for all vertices: a feature that reaches out of
/// its patch may meet what lies in it. (Other libraries' rules: IPC Toolkit's can_collide leaves a pair out
/// when all its pairs of vertices are excluded, as `patches` here; Isaac Lab's
/// particle_topological_contact_filter_threshold and particle_rest_shape_contact_exclusion_radius are the
/// first and the third.)
struct PairFilters {
  static constexpr std::uint32_t kMostEdges = 3;

  /// 0 to kMostEdges. Edges of faces, along any way within a body.
  std::uint32_t within_edges = 0;
  /// Scene units, finite, >= 0; 0: off.
  double near_at_rest = 0;
  /// (n, 3), finite: the rest shape. Only, and always, where near_at_rest is not 0.
  std::vector<double> rest_positions = {};
  /// Of different vertices, in any order; of one body or two.
  std::vector<std::array<std::uint32_t, 2>> excluded_vertex_pairs = {};
  /// A number a vertex, 0: in no patch; or empty. Patches may hold vertices of several bodies.
  std::vector<std::uint32_t> patches = {};

  /// Is any pair left out, or could be?
  bool any() const {
    return within_edges != 0 || near_at_rest > 0 || !excluded_vertex_pairs.empty() || !patches.empty();
  }
  /// kInvalidArgument, with the field, for numbers out of range; of the arrays Scene::create() looks.
  Status check_numbers() const;
  /// Takes these positions, (n, 3), as the rest shape if one is needed and none is given.
  void rest_at(const Positions& positions);
  /// A body of `count` vertices is appended to the scene: it is in no patch, and at rest at `positions`.
  void append_body(std::uint32_t count, std::span<const double> positions);
  /// The `count` vertices from `first` on make way for `new_count`, of which the same holds. Pairs of
  /// vertices stay as they are.
  void replace_body(std::uint32_t first, std::uint32_t count, std::uint32_t new_count,
                    std::span<const double> positions);

  friend bool operator==(const PairFilters&, const PairFilters&) = default;
};

}  // namespace warmfront
