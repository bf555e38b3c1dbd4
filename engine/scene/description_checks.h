// SPDX-License-Identifier: Apache-2.0
// What a scene's description must fulfil. Pure functions; kInvalidArgument names the field and the first
// offender. Those with a StopSignal throw Stopped when told to stop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "engine/result.h"
#include "engine/scene.h"
#include "engine/stop.h"

namespace warmfront {

/// All vertex indices are in range. `hint` ends a message about one that is not.
Status check_faces(const SceneDescription& description, StopSignal stop, const char* hint = "");
/// Likewise, and each edge has two.
Status check_edges(const SceneDescription& description, StopSignal stop, const char* hint = "");
/// There are numbers for all.
Status check_size(std::uint64_t vertices, std::uint64_t faces, std::uint64_t edges);

/// What vertices have besides their bodies': as long as any length is that double can add to another.
Status check_thickness(const SceneDescription& description, StopSignal stop);
inline constexpr double kMostThickness = 0x1p1020;

/// Of a half-space's normal, in each coordinate: a rotation of it stays within double's range.
inline constexpr double kMostNormal = 0x1p1020;

/// A body in messages about descriptions.
std::string name_of(std::size_t body);
/// A body in messages about what becomes of it: its index, and the name that its caller knows it by, where it
/// has one: `body 3 ("sleeve")`. Of a long name the beginning.
std::string in_words(std::size_t index, const Body& body);
/// What is wrong with what a frame gives a body, at `where` in its list: the body is said, too, because who
/// keeps bodies by their numbers does not know that place.
Error of_body(const std::string& where, std::size_t index, const Body& body, const Error& wrong);

/// One of so many bodies. `where` is what gives its number.
Status check_body_number(const std::string& where, std::uint32_t number, std::size_t bodies);

/// A body's description, except its range. `where` names it.
Status check_body(const Body& body, const std::string& where);

/// Each is tested against all that it may meet: more than these would be a mesh.
inline constexpr std::size_t kMostHalfSpaces = 1024;
/// No more half-spaces than that, but for those that are removed.
Status check_half_spaces(std::span<const Body> bodies);

/// Each of two different bodies that there are.
Status check_excluded_pairs(std::span<const std::array<std::uint32_t, 2>> pairs, std::size_t bodies,
                            StopSignal stop);

/// All bodies, with their ranges, and the excluded pairs.
Status check_bodies(const SceneDescription& description, StopSignal stop);

/// Filters of a scene of so many vertices.
Status check_filters(const PairFilters& filters, std::uint32_t vertex_count, StopSignal stop);

/// All of the above that is said of a description. `hint`: of its faces and edges.
Status check_description(const SceneDescription& description, StopSignal stop, const char* hint = "");

/// No face and no lone edge joins two bodies.
Status check_faces_of_bodies(std::span<const Face> faces, std::span<const std::uint32_t> body_of_vertex,
                             StopSignal stop);
Status check_edges_of_bodies(std::span<const Edge> edges, std::span<const std::uint32_t> lone_edges,
                             std::span<const std::uint32_t> body_of_vertex, StopSignal stop);

}  // namespace warmfront
