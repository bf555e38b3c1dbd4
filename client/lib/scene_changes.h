// SPDX-License-Identifier: Apache-2.0
// Changes of a session's scene between two frames, as they are asked for. Plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "engine/frame.h"
#include "engine/scene.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::client {

/// A body at rest at these positions, (k, 3), which are only looked at while the change is carried out.
struct PutBody {
  std::optional<std::uint32_t> index;  ///< in place of this one; none: behind all others
  BodyAddition addition;
  Positions positions;
};

/// One change. SceneState makes a request of it, and applies it to the scene that is kept for a resume.
using SceneEdit = std::variant<PutBody, ReplaceElements, ChangeBody, ChangeFilters, ChangeExcludedPairs>;

/// What a daemon must know to carry it out, in the order in which they are checked.
std::vector<v1::Feature> features_of(const SceneEdit& edit);

}  // namespace warmfront::client
