// SPDX-License-Identifier: Apache-2.0
// Finds the parts that move rigidly, which need no test against themselves. Used by one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/bvh/topology.h"
#include "engine/motion/rigid_fit.h"
#include "engine/motion/scene_motion.h"
#include "engine/options.h"
#include "engine/scene/collision_model.h"
#include "engine/scene/thickness.h"
#include "engine/stop.h"
#include "engine/workers.h"

namespace warmfront {

/// Finds, of a scene at rest, the bodies of which two features that would be tested against each other come
/// within `distance`, in no order; nothing where that could not be found out. Parallel; throws Stopped when
/// told to stop. It takes a step of another scene, so whoever steps scenes brings it.
using BodiesWithin = std::optional<std::vector<std::uint32_t>> (*)(std::shared_ptr<const Scene> scene,
                                                                   std::span<const double> positions,
                                                                   double distance,
                                                                   std::shared_ptr<Workers> workers,
                                                                   StopSignal stop);

/// A part is treated as rigid in a step only where that changes no answer. The argument: let its vertices be
/// at both ends of the step within e of where a linear map and a translation put a reference of them. In
/// between, vertices move linearly, so that points of the part are within e of an affine image of the
/// reference, by the map that is as far between the two. Where these maps shrink no distance to less than c
/// of it (two rotations an angle of at most 90 degrees apart: cos(45 degrees); others: least_stretch.h), and
/// all the features of the reference that would be tested against each other are farther apart than d, they
/// stay farther apart than c d - 2 e throughout the step; when that is more than what the tier reports at
/// (min_separation, and the tolerance), there is no contact to find.
/// d comes from one step of the references at rest, with d as its min_separation.
///
/// Only for the tiers that promise to report nothing farther apart, certified and exact, and not for edges
/// that go through faces: these features may be far apart then.
class RigidParts {
 public:
  struct EdgeLengths {
    double mean = 0;
    double longest = 0;
  };

  /// Makes room for the model's parts.
  void make_room(const CollisionModel& model) { parts_.resize(model.part_count()); }
  /// Forgets a part's state where the model says that it is not tested against itself. After make_room().
  void take(const CollisionModel& model) noexcept;
  /// Forgets a part's state: it is another one now. After make_room().
  void forget(PartId part) noexcept { parts_[number_of(part)] = {}; }
  /// The same of one that has other elements on the vertices that it had: one that was seen not to move
  /// rigidly is looked at no sooner for that.
  void forget_elements(PartId part) noexcept {
    const std::uint32_t wait = parts_[number_of(part)].wait;
    const std::uint32_t backoff = parts_[number_of(part)].backoff;
    forget(part);
    parts_[number_of(part)].wait = wait;
    parts_[number_of(part)].backoff = backoff;
  }

  /// A part is measured after so many steps in a row that fitted: it takes about as long as the part's share
  /// of a first step, some ten warm ones, and what falls may land and deform.
  static constexpr std::uint32_t kSteps = 16;

  /// Looks at a step's motion, after it began; measures some of the parts that are due. Parallel; call it
  /// inside Workers::run(). Throws Stopped when told to stop. A part whose measurement ended so, or by an
  /// exception, is measured again only after ever more steps: a measurement that takes longer than a caller's
  /// deadline fails a few steps of very many. `trial`: the motion is only asked about.
  void look(const Topology& topology, const SceneMotion& motion, const CollisionModel& model,
            const ColliderOptions& options, const Thickness& thickness,
            const std::shared_ptr<Workers>& workers, BodiesWithin bodies_within, bool trial, StopSignal stop);
  /// The step was taken back, or what is asked for has changed: nothing that was learnt of it holds.
  void undo() noexcept;
  /// Where parts are is not where any motion that was looked at ended.
  void lose_track() noexcept;
  /// The same, and the parts that are marked, by part, were put elsewhere.
  void lose_track(std::span<const std::uint8_t> marked) noexcept;
  /// What moves in the motion that was begun is to be rounded, and so may come nearer to itself.
  void lose_rounded(const SceneMotion& motion) noexcept;

  /// Needs the part no test against itself in this step?
  bool rigid(PartId part) const { return number_of(part) < parts_.size() && parts_[number_of(part)].rigid; }
  /// How many parts that is.
  std::uint64_t count() const { return count_; }

  std::size_t memory_bytes() const;

 private:
  struct Part {
    std::unique_ptr<RigidReference> reference;
    RigidReference::Fit at_start;  // of the last motion that was looked at
    RigidReference::Fit at_end;
    bool follows = false;             // that was the motion before
    std::uint32_t fitted = 0;         // steps in a row that fitted
    EdgeLengths edges;                // of the reference
    std::optional<double> clearance;  // of the reference, once measured; 0: too little
    int rung = 0;                     // of the ladder of clearances
    std::uint32_t wait = 0;           // steps until it is looked at again
    std::uint32_t backoff = 1;
    std::uint32_t interruptions = 0;  // of its measurement
    bool rigid = false;
  };

  void give_up(Part& part);
  static void postpone(Part& part);
  void look_at(Part& part, const PartTopology& topology, const Scene& scene, const SceneMotion& motion,
               MotionState state, const ColliderOptions& options, double separation, bool trial,
               StopSignal stop);
  double wanted_clearance(PartId part) const;
  std::vector<PartId> due(const Topology& topology, const SceneMotion& motion) const;
  void measure(std::span<const PartId> parts, const Topology& topology,
               const std::shared_ptr<Workers>& workers, BodiesWithin bodies_within, StopSignal stop);

  std::vector<Part> parts_;
  std::uint64_t count_ = 0;
};

}  // namespace warmfront
