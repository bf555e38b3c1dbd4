// SPDX-License-Identifier: Apache-2.0
// A body that has changed locally, as a scene of its own: made of what it was before. Pure functions; all
// throw Stopped when told to stop.
#pragma once

#include "engine/scene.h"
#include "engine/scene/local_change.h"
#include "engine/scene/renumbering.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

class ChangedScene {
 public:
  /// What Scene::create() makes of a description of one body without filters, which was checked; `change` is
  /// what find_local_change() says of it, as given. O(body), of which most is copying.
  static Scene as_given(const Scene& before, const MeshRange& part, SceneDescription description,
                        const LocalChange& change, StopSignal stop);

  /// What numbering.extend() makes of the body alone as `given`: it was `part` of the renumbered scene
  /// `before`, and its vertices keep their numbers; `change` is renumbered. Parallel inside Workers::run().
  static Scene renumbered(const Scene& before, const MeshRange& part, const Scene& given,
                          const Renumbering& numbering, const LocalChange& change, StopSignal stop);
};

}  // namespace warmfront
