// SPDX-License-Identifier: Apache-2.0
// Numbers of things as types, so that one of another kind cannot be handed in. An index is number_of() one; a
// type made from an index is written as NodeId{index}.
#pragma once

#include <cstdint>
#include <type_traits>

namespace warmfront {

/// Types whose values number things of one kind: scoped enumerations of 32 bits, compared and hashed as such.
template <class Id>
inline constexpr bool kIsNumber = false;
template <class Id>
concept Number = kIsNumber<Id> && std::is_enum_v<Id> && sizeof(Id) == sizeof(std::uint32_t);

/// The same as an index.
template <Number Id>
constexpr std::uint32_t number_of(Id id) {
  return static_cast<std::uint32_t>(id);
}

/// The one that comes so many after it, and so many lie between two. As with unsigned integers, both are
/// modulo 2^32.
template <Number Id>
constexpr Id operator+(Id id, std::uint32_t further) {
  return Id{number_of(id) + further};
}
template <Number Id>
constexpr std::uint32_t operator-(Id end, Id begin) {
  return number_of(end) - number_of(begin);
}
template <Number Id>
constexpr Id& operator+=(Id& id, std::uint32_t further) {
  return id = id + further;
}
template <Number Id>
constexpr Id& operator++(Id& id) {
  return id += 1;
}

/// The number that the user gave a vertex or a face: what frames, contacts and errors name. This number and
/// the next convert into each other in Renumbering alone.
enum class GivenVertex : std::uint32_t {};
enum class GivenFace : std::uint32_t {};
/// Its number in the order of the hierarchies. The engine's rooms work in these numbers: a plain index into a
/// renumbered scene, a motion or its bounds is one, and no GivenVertex or GivenFace.
enum class NewVertex : std::uint32_t {};
enum class NewFace : std::uint32_t {};
/// An edge keeps its number. scene_edges.h makes them from what a Scene lists.
enum class EdgeId : std::uint32_t {};

template <>
inline constexpr bool kIsNumber<GivenVertex> = true;
template <>
inline constexpr bool kIsNumber<GivenFace> = true;
template <>
inline constexpr bool kIsNumber<NewVertex> = true;
template <>
inline constexpr bool kIsNumber<NewFace> = true;
template <>
inline constexpr bool kIsNumber<EdgeId> = true;

}  // namespace warmfront
