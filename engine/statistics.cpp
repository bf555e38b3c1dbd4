// SPDX-License-Identifier: Apache-2.0
#include "engine/statistics.h"

namespace warmfront {

std::string_view to_string(FrontState state) {
  switch (state) {
    case FrontState::kNone:
      return "none";
    case FrontState::kBuilt:
      return "built";
    case FrontState::kUpdated:
      return "updated";
    case FrontState::kRebuilt:
      return "rebuilt";
    case FrontState::kCapped:
      return "capped";
  }
  return "unknown";
}

void add(StepCounts& sum, const StepCounts& more) {
  sum.bv_tests += more.bv_tests;
  sum.primitive_tests += more.primitive_tests;
  sum.front_pairs += more.front_pairs;
  sum.front_bytes += more.front_bytes;
  sum.front_skipped += more.front_skipped;
  sum.front_sprouted += more.front_sprouted;
  sum.front_pruned += more.front_pruned;
  sum.triangle_pairs += more.triangle_pairs;
  sum.adjacent_pairs += more.adjacent_pairs;
  sum.cone_culled_pairs += more.cone_culled_pairs;
  sum.cone_patches += more.cone_patches;
  sum.elementary_tests += more.elementary_tests;
  sum.orphan_tests += more.orphan_tests;
  sum.coplanarity_passed += more.coplanarity_passed;
  sum.exact_tests += more.exact_tests;
  sum.front_rested += more.front_rested;
  sum.contacts_kept += more.contacts_kept;
  sum.vertices_moved += more.vertices_moved;
  sum.nodes_refit += more.nodes_refit;
  sum.parts += more.parts;
  sum.parts_moved += more.parts_moved;
  sum.parts_rigid += more.parts_rigid;
  sum.near_parts += more.near_parts;
  sum.parts_apart += more.parts_apart;
  sum.part_pairs_excluded += more.part_pairs_excluded;
}

}  // namespace warmfront
