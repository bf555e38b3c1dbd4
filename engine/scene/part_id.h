// SPDX-License-Identifier: Apache-2.0
// The numbers of parts.
#pragma once

#include "engine/scene/numbers.h"

namespace warmfront {

/// A part of the scene, which has a hierarchy of its own: a body, or all of a scene that declares none.
enum class PartId : std::uint32_t {};
template <>
inline constexpr bool kIsNumber<PartId> = true;

/// The part that a body is, by its number in the scene's description, which is the user's.
constexpr PartId part_of_body(std::uint32_t body) {
  return PartId{body};
}
/// The other way round; 0 where no bodies are declared.
constexpr std::uint32_t body_of_part(PartId part) {
  return number_of(part);
}

}  // namespace warmfront
