// SPDX-License-Identifier: Apache-2.0
// The two numbers that a vertex or a face has, as types: they convert into each other in Renumbering alone.
#pragma once

#include <cstdint>
#include <type_traits>

namespace warmfront {

/// The number that the user gave a vertex or a face: what frames, contacts and errors name.
enum class GivenVertex : std::uint32_t {};
enum class GivenFace : std::uint32_t {};
/// Its number in the order of the hierarchies. The engine's rooms work in these numbers: a plain index into a
/// renumbered scene, a motion or its bounds is one, and no GivenVertex or GivenFace.
enum class NewVertex : std::uint32_t {};
enum class NewFace : std::uint32_t {};

/// The same as an index.
template <class Id>
requires std::is_enum_v<Id>
constexpr std::uint32_t number_of(Id id) {
  return static_cast<std::uint32_t>(id);
}

}  // namespace warmfront
