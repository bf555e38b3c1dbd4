// SPDX-License-Identifier: Apache-2.0
// What a step measured of itself. Plain values.
#pragma once

#include <cstdint>
#include <string_view>

#include "engine/options.h"

namespace warmfront {

/// What became of the front in a step.
enum class FrontState : std::uint8_t {
  kNone,     ///< mode `none`: traversed from the root
  kBuilt,    ///< built from scratch, the first time
  kUpdated,  ///< updated from the step before
  kRebuilt,  ///< rebuilt: the paper's rule, or the hierarchy was rebuilt
  kCapped,   ///< longer than the cap: traversed from the root
};
std::string_view to_string(FrontState state);

/// Why a front that was there was made anew.
enum class Rebuild : std::uint8_t {
  kNone,         ///< it was not, or there was none
  kPolicy,       ///< the paper's rule, or every K steps
  kDecayed,      ///< a hierarchy had become loose, and is a new one
  kInterrupted,  ///< the step before was cancelled, failed or taken back
  kCapped,       ///< it had been longer than the cap
  kBounds,       ///< with option auto, another kind of bounds is tried or stays
  kForgotten,    ///< what was kept was forgotten on demand, as after a failed self-check
};

/// Wall-clock milliseconds. `front` and `elementary` run interleaved, block by block: of their common wall
/// time, `elementary` is what the threads spent in the cascade divided by the number of threads, and `front`
/// is the rest. So do `refit` and the front's tests among neighbours, subtree by subtree: what the thread
/// took for these that took longest is `front`.
struct StageTimes {
  double total = 0;
  double refit = 0;       ///< motion, moving bounds, hierarchy refit or build, normal cones
  double front = 0;       ///< front build or update, triangle pair bounds, ownership
  double elementary = 0;  ///< elementary tests of non-adjacent pairs, and gathering the answer
  double adjacent = 0;    ///< elementary tests of the orphan sets
};

/// Counts that follow from the frames since the collider was made: the same for any number of threads and on
/// any machine. But `front_bytes` holds room that depends on which thread asked for it; and for
/// Report::kEarliest what is found first prunes the rest, so that only those of bodies and their motion do
/// (adjacent_pairs, vertices_moved, parts*, near_parts, part_pairs_excluded).
struct StepCounts {
  std::uint64_t bv_tests = 0;           ///< overlap tests between hierarchy nodes
  std::uint64_t primitive_tests = 0;    ///< overlap tests between slots of two blocks, which may be empty in
                                        ///< smaller ones (none for leaf_size 1)
  std::uint64_t front_pairs = 0;        ///< length of the front after the step
  std::uint64_t front_bytes = 0;        ///< memory the front holds
  std::uint64_t front_skipped = 0;      ///< front pairs that were not looked at: still apart for certain
  std::uint64_t front_rested = 0;       ///< front pairs not looked at: neither node changed in this step
  std::uint64_t front_sprouted = 0;     ///< front pairs that were opened
  std::uint64_t front_pruned = 0;       ///< front pairs that were folded into an ancestor
  std::uint64_t triangle_pairs = 0;     ///< non-adjacent triangle pairs whose moving bounds overlap
  std::uint64_t adjacent_pairs = 0;     ///< of the mesh: they always overlap, and the orphan sets test them
  std::uint64_t cone_culled_pairs = 0;  ///< triangle pairs left out by normal cone and contour
  std::uint64_t cone_patches = 0;       ///< patches whose self-collision was culled in this step
  /// Feature pairs whose moving bounds overlap, each given to the elementary cascade once, orphans included.
  std::uint64_t elementary_tests = 0;
  std::uint64_t orphan_tests = 0;         ///< pairs of the orphan sets whose moving bounds were tested
  std::uint64_t coplanarity_passed = 0;   ///< left after the coplanarity filter
  std::uint64_t exact_tests = 0;          ///< decided by exact arithmetic
  std::uint64_t contacts_kept = 0;        ///< contacts between features at rest, found in an earlier step
  std::uint64_t vertices_moved = 0;       ///< vertices that are not where they were
  std::uint64_t nodes_refit = 0;          ///< hierarchy nodes whose bounds were made anew
  std::uint64_t parts = 0;                ///< bodies, declared or found; 1 where there are none
  std::uint64_t parts_moved = 0;          ///< parts in which something moved
  std::uint64_t parts_rigid = 0;          ///< parts found to move rigidly: not tested against themselves
  std::uint64_t near_parts = 0;           ///< pairs of parts, a part with itself included, with a front
  std::uint64_t parts_apart = 0;          ///< pairs of parts that are near, and that a plane keeps apart
  std::uint64_t part_pairs_excluded = 0;  ///< pairs of parts that the model leaves out
};
/// Calls X with the name of each count, for what does the same with all of them.
#define WARMFRONT_STEP_COUNTS(X)                                                                      \
  X(bv_tests)                                                                                         \
  X(primitive_tests) X(front_pairs) X(front_bytes) X(front_skipped) X(front_rested) X(front_sprouted) \
      X(front_pruned) X(triangle_pairs) X(adjacent_pairs) X(cone_culled_pairs) X(cone_patches)        \
          X(elementary_tests) X(orphan_tests) X(coplanarity_passed) X(exact_tests) X(contacts_kept)   \
              X(vertices_moved) X(nodes_refit) X(parts) X(parts_moved) X(parts_rigid) X(near_parts)   \
                  X(parts_apart) X(part_pairs_excluded)
#define WARMFRONT_ONE(name) +1
static_assert(sizeof(StepCounts) == sizeof(std::uint64_t) * (0 WARMFRONT_STEP_COUNTS(WARMFRONT_ONE)));
#undef WARMFRONT_ONE

/// Adds every count of `more` to `sum`.
void add(StepCounts& sum, const StepCounts& more);

struct StepStatistics {
  StageTimes ms;
  StepCounts counts;
  FrontState front_state = FrontState::kNone;
  BoundsKind bounds = BoundsKind::kKDop18;  ///< that the step used
  Rebuild rebuild = Rebuild::kNone;
};

}  // namespace warmfront
