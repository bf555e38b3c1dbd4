// SPDX-License-Identifier: Apache-2.0
// A step's measurements. Plain values.
#pragma once

#include <cstdint>
#include <string_view>

#include "engine/options.h"

namespace warmfront {

/// State of the front after a step.
enum class FrontState : std::uint8_t {
  kNone,     ///< mode `none`: traversed from the root
  kBuilt,    ///< built from scratch, the first time
  kUpdated,  ///< updated from the previous step
  kRebuilt,  ///< rebuilt: the paper's rule, or the hierarchy was rebuilt
  kCapped,   ///< longer than the cap: traversed from the root
};
std::string_view to_string(FrontState state);

/// Why an existing front was rebuilt.
enum class Rebuild : std::uint8_t {
  kNone,         ///< not rebuilt, or there was none
  kPolicy,       ///< the paper's rule, or every K steps
  kDecayed,      ///< a hierarchy had become loose and was rebuilt
  kInterrupted,  ///< the previous step was cancelled, failed or rolled back
  kCapped,       ///< it had been longer than the cap
  kBounds,       ///< option auto: the kind of bounds was tried or chosen
  kForgotten,    ///< cached data were dropped on request, for example after a failed self-check
};

/// Wall-clock milliseconds; the stages add up to the total. Some stages share a loop: `refit` and the front's
/// tests of neighbours, subtree by subtree; `front` and `elementary`, block by block. The wall time of such a
/// loop is divided in proportion to the threads' time in each of its stages: every thread has a clock that is
/// read whenever the thread changes from one stage to another.
struct StageTimes {
  double total = 0;
  double refit = 0;       ///< motion, moving bounds, hierarchy refit or build, normal cones
  double front = 0;       ///< front build or update, triangle pair bounds, ownership
  double elementary = 0;  ///< elementary tests of non-adjacent pairs, and collecting the answer
  double adjacent = 0;    ///< elementary tests of the orphan sets
};

/// Counts are functions of the frames since the collider was created: the same for any number of threads and
/// on any machine. Exceptions: `front_bytes` includes memory that depends on thread scheduling; and for
/// Report::kEarliest, early contacts prune later work, so that only counts of bodies and their motion are
/// deterministic (adjacent_pairs, vertices_moved, parts*, near_parts, part_pairs_excluded).
struct StepCounts {
  std::uint64_t bv_tests = 0;           ///< overlap tests between hierarchy nodes
  std::uint64_t primitive_tests = 0;    ///< overlap tests between slots of two blocks, which may be empty in
                                        ///< smaller ones (none for leaf_size 1)
  std::uint64_t front_pairs = 0;        ///< length of the front after the step
  std::uint64_t front_bytes = 0;        ///< memory the front holds
  std::uint64_t front_skipped = 0;      ///< front pairs skipped: still certainly apart
  std::uint64_t front_rested = 0;       ///< front pairs skipped: neither node changed in this step
  std::uint64_t front_sprouted = 0;     ///< front pairs that were opened
  std::uint64_t front_pruned = 0;       ///< front pairs that were folded into an ancestor
  std::uint64_t triangle_pairs = 0;     ///< pairs of triangles and lone edges without a common vertex
                                        ///< whose moving bounds overlap
  std::uint64_t adjacent_pairs = 0;     ///< of the mesh: they always overlap, and the orphan sets test them
  std::uint64_t cone_culled_pairs = 0;  ///< triangle pairs excluded by normal cone and contour
  std::uint64_t cone_patches = 0;       ///< patches whose self-collision was culled in this step
  /// Feature pairs whose moving bounds overlap, each given to the elementary cascade once, orphans included.
  std::uint64_t elementary_tests = 0;
  std::uint64_t orphan_tests = 0;         ///< pairs of the orphan sets whose moving bounds were tested
  std::uint64_t coplanarity_passed = 0;   ///< left after the coplanarity filter
  std::uint64_t exact_tests = 0;          ///< decided by exact arithmetic
  std::uint64_t contacts_kept = 0;        ///< cached contacts between stationary features
  std::uint64_t vertices_moved = 0;       ///< vertices whose position changed
  std::uint64_t nodes_refit = 0;          ///< hierarchy nodes whose bounds were recomputed
  std::uint64_t parts = 0;                ///< bodies, declared or found; 1 if there are none
  std::uint64_t parts_moved = 0;          ///< parts with a moved vertex
  std::uint64_t parts_rigid = 0;          ///< parts found to move rigidly: not tested against themselves
  std::uint64_t near_parts = 0;           ///< pairs of parts with a front, including a part with itself
  std::uint64_t parts_apart = 0;          ///< pairs of near parts that a plane separates
  std::uint64_t part_pairs_excluded = 0;  ///< pairs of parts that the model excludes
  /// Pairs of triangles that filters leave out as a whole, of those that the traversal came to.
  std::uint64_t triangle_pairs_filtered = 0;
  /// Feature pairs whose moving bounds overlap and that filters leave out, of other triangles, and of
  /// orphans.
  std::uint64_t feature_pairs_filtered = 0;
};
/// Calls X with the name of each count, for code that treats all alike.
#define WARMFRONT_STEP_COUNTS(X)                                                                             \
  X(bv_tests)                                                                                                \
  X(primitive_tests)                                                                                         \
  X(front_pairs)                                                                                             \
  X(front_bytes)                                                                                             \
  X(front_skipped)                                                                                           \
  X(front_rested)                                                                                            \
  X(front_sprouted) X(front_pruned) X(triangle_pairs) X(adjacent_pairs) X(cone_culled_pairs) X(cone_patches) \
      X(elementary_tests) X(orphan_tests) X(coplanarity_passed) X(exact_tests) X(contacts_kept)              \
          X(vertices_moved) X(nodes_refit) X(parts) X(parts_moved) X(parts_rigid) X(near_parts)              \
              X(parts_apart) X(part_pairs_excluded) X(triangle_pairs_filtered) X(feature_pairs_filtered)
#define WARMFRONT_ONE(name) +1
static_assert(sizeof(StepCounts) == sizeof(std::uint64_t) * (0 WARMFRONT_STEP_COUNTS(WARMFRONT_ONE)));
#undef WARMFRONT_ONE

/// Adds every count of `more` to `sum`.
void add(StepCounts& sum, const StepCounts& more);

/// Milliseconds of one thread that a step takes which does what another one did, if the whole scene of so
/// many triangles and lone edges moves. By counts, which are the same however busy the machine is: a measured
/// time would call a small step long that had to wait for others. The weights are fitted to the sequences of
/// tests/README.md, whose steps they meet within a third; what the smallest step takes is mostly its answer's
/// way out.
double step_cost_ms(std::uint64_t elements, const StepCounts& like);

struct StepStatistics {
  StageTimes ms;
  StepCounts counts;
  FrontState front_state = FrontState::kNone;
  BoundsKind bounds = BoundsKind::kKDop18;  ///< that the step used
  Rebuild rebuild = Rebuild::kNone;
  /// A trial that went part of the way of the one before it, whose hierarchies and front served: of these
  /// nothing is counted.
  bool part_of_trial = false;
};

}  // namespace warmfront
