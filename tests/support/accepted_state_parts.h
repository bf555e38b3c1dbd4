// SPDX-License-Identifier: Apache-2.0
// What the sources of AcceptedState share. Pure functions.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/elementary/half_space.h"
#include "tests/support/accepted_state.h"
#include "tests/support/brute_force.h"
#include "tests/support/commit_room_oracle.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {

/// A body's numbers among all positions: where they begin, and how many they are.
inline std::ptrdiff_t first_number(const Body& body) {
  return std::ptrdiff_t{3} * body.first_vertex;
}
inline std::ptrdiff_t numbers(const Body& body) {
  return std::ptrdiff_t{3} * body.vertex_count;
}
/// Where the step puts everything.
std::vector<double> target_of(const AcceptedState& state, const StepOperation& step);
/// What of all contacts of a question the options ask for; `made` is the scene as made.
Outcome answer_of(std::vector<Contact> contacts, const SceneDescription& scene, const Scene& made,
                  const ColliderOptions& options);
/// Adds the geometry of each contact of the outcome, on these motions.
void describe(Outcome& outcome, const Scene& made, std::span<const VertexMotion> vertices,
              std::span<const HalfSpaceMotion> half_spaces, const Twists& twists);
/// By body: what poses of a step turn along screws.
Twists twists_of(const AcceptedState& state, const StepOperation& step);
/// By body: how what poses of a step move is rounded by a commit.
std::vector<PosedRounding> posed_by(const AcceptedState& state, const StepOperation& step);
/// By body: half-spaces on their way from where they are to where a step, if any, takes them.
std::vector<HalfSpaceMotion> half_spaces_of(const AcceptedState& state, const StepOperation* step);
/// A mesh whose faces and edges count from 0.
struct Shape {
  Faces faces;
  Edges edges;
  std::vector<double> positions;
};
/// As random_scene() has it.
Shape draw_shape(Draws& draws);
/// A body of a scene whose lengths are near `unit`; one that may turn is perhaps a screw's.
Body draw_body(Draws& draws, std::size_t vertex_count, double unit, bool may_turn);
/// Near the middle of the scene, at any slope; some normals are exact, long or short.
Body draw_half_space(Draws& draws, double unit, double offset);
/// Appends elements that number their own vertices from 0: of vertices to be added.
void append(const Faces& faces, const Edges& edges, SceneDescription& to);

}  // namespace warmfront::testing
