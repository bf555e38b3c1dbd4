// SPDX-License-Identifier: Apache-2.0
// Several changes of a warm scene as one transaction.
#pragma once

#include <cstddef>
#include <span>

#include "engine/step/warm_scene.h"

namespace warmfront {

/// While there is no trial to commit. All of the changes, in their order, or none: as Collider::change(), whose work this is. `at` is the change
/// that an error is of. Throws Stopped when told to stop, and std::bad_alloc; the scene is as before then.
Status change_scene(WarmScene& warm, std::span<SceneChange> changes, StopSignal stop, std::size_t& at);

}  // namespace warmfront
