// SPDX-License-Identifier: Apache-2.0
// Which pairs filters leave out, found for each pair alone from the words of engine/pair_filters.h: distances
// along edges by a search from every vertex, distances at rest by the oracle for separations, and by the
// engine's predicate for an edge that meets a face (property_intersections_test). Slow. Used by one thread at
// a time.
#pragma once

#include <cstdint>
#include <map>
#include <tuple>
#include <vector>

#include "engine/contact.h"
#include "engine/scene.h"

namespace warmfront::testing {

class PairRules {
 public:
  /// `scene` must outlive this.
  PairRules(const Scene& scene, PairFilters filters);

  /// Is the pair of features left out, for a contact of any kind?
  bool leave_out(const Contact& contact) const;

 private:
  bool are_near_at_rest(ContactKind kind, const std::vector<std::uint32_t>& a,
                        const std::vector<std::uint32_t>& b) const;

  const Scene& scene_;
  const PairFilters filters_;
  std::vector<std::vector<std::uint32_t>> edges_between_;  // by two vertices; kFar: more than any filter asks
  mutable std::map<std::tuple<ContactKind, std::uint32_t, std::uint32_t>, bool> near_at_rest_;
};

}  // namespace warmfront::testing
