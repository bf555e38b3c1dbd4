// SPDX-License-Identifier: Apache-2.0
// Checks part by part and segment by segment. Thread safety: see the header.
#include "engine/check/self_check.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <string>

#include "engine/bounds/moving.h"
#include "engine/bvh/topology_checksum.h"
#include "engine/check/check_hierarchy.h"
#include "engine/check/check_neighbours.h"
#include "engine/check/check_segment.h"
#include "engine/front/descend.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

/// The first fault found by any thread.
class Finding {
 public:
  explicit operator bool() const { return found_.load(std::memory_order_relaxed); }
  void report(ErrorCode code, const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (!found_.exchange(true)) error_ = Error{code, "self-check: " + what};
  }
  Status status() const { return error_ ? Status(*error_) : Status(); }

 private:
  std::atomic<bool> found_{false};
  std::mutex mutex_;
  std::optional<Error> error_;
};

template <class Bounds>
class SelfCheck {
 public:
  explicit SelfCheck(const KeptState<Bounds>& kept) : kept_(kept), core_(kept.core) {}

  Status run() {
    if (checksum(core_, kept_.stop) != core_.checksum())
      found_.report(ErrorCode::kDataLoss, "the scene's topology has changed");
    if (filter_checksum(core_.filter, kept_.stop) != core_.filter.built_sum())
      found_.report(ErrorCode::kDataLoss, "what the scene's filters leave out has changed");
    if (thickness_checksum(core_.thickness, kept_.stop) != core_.thickness.built_sum())
      found_.report(ErrorCode::kDataLoss, "the thickness of the scene's vertices has changed");
    if (kept_.trees.size() != core_.topology->parts.size())
      found_.report(ErrorCode::kInternal, "the numbers of parts and hierarchies differ");
    if (!found_) {
      tbb::parallel_for(std::size_t{0}, kept_.trees.size(),
                        [&](std::size_t p) { check_part(PartId{static_cast<std::uint32_t>(p)}); });
    }
    if (!found_) check_near();
    if (!found_) check_apart();
    if (!found_ && kept_.front != nullptr) check_front();
    return found_.status();
  }

 private:
  void broken(const std::string& what) { found_.report(ErrorCode::kInternal, what); }

  // Are the part's bounds those of the last step?
  bool current(PartId p) const {
    return !core_.model.is_removed(p) && kept_.refit_in[number_of(p)] == kept_.step &&
           !kept_.trees[number_of(p)].nodes.empty() && !kept_.trees[number_of(p)].order.empty();
  }

  void check_part(PartId p) {
    kept_.stop.check();
    if (!current(p)) return;
    const std::string of_part = " of part " + std::to_string(number_of(p));
    const Bvh<Bounds>& tree = kept_.trees[number_of(p)];
    const HierarchyCheck<Bounds> hierarchy(tree, core_.topology->parts[number_of(p)], core_, kept_.stop);
    if (!hierarchy.holds_each_once())
      return broken("the hierarchy" + of_part + " does not contain each primitive exactly once");
    if (!hierarchy.patches_agree())
      return broken("the patches of nodes" + of_part + " are not those of the filters");
    if (!hierarchy.leaves_agree())
      return broken("the leaves" + of_part + " do not match its primitive order");
    const FeatureRange& features = core_.topology->parts[number_of(p)].features;
    for_each_index(features.first_vertex, features.end_vertex, kept_.stop, [&](std::size_t i) {
      const auto v = static_cast<std::uint32_t>(i);
      const Motion& motion = core_.motion.vertices();
      const PointBounds bounds = point_bounds(motion.vertices()[v], motion.frame(), kept_.magnitude);
      if (!(core_.vertex_bounds[v] == bounds))
        found_.report(ErrorCode::kDataLoss,
                      "vertex " + std::to_string(number_of(core_.topology->numbering.given(NewVertex{v}))) +
                          " is outside its bounds");
    });
    for_each_index(
        0, tree.shape.node_count(), kept_.stop,
        [&](std::size_t i) {
          if (!hierarchy.node_holds(NodeId{static_cast<std::uint32_t>(i)}))
            broken("node " + std::to_string(i) + of_part + " does not contain its children");
        },
        HierarchyCheck<Bounds>::kAtOnce);
  }

  // Pairs of parts that may meet and whose bounds overlap must be in `near` or `apart`.
  void check_near() {
    const auto parts = static_cast<std::uint32_t>(kept_.roots.size());
    constexpr std::uint64_t kTests = 1U << 20;
    const std::uint64_t rows = std::clamp<std::uint64_t>(kTests / std::max(parts, 1U), 1, parts);
    tbb::parallel_for(std::uint64_t{0}, rows, [&](std::uint64_t row) {
      PacedStop paced(kept_.stop);
      kept_.stop.check();
      const PartId p{static_cast<std::uint32_t>((kept_.turn * rows + row) % parts)};
      for (PartId q{0}; q < PartId{parts}; ++q) {
        paced.check();
        const PartPair pair{std::min(p, q), std::max(p, q)};
        if (core_.model.is_removed(p) || core_.model.is_removed(q)) continue;
        if (p == q ? !core_.tests_itself(p)
                   : !core_.model.may_meet(p, q) ||
                         !overlap(kept_.roots[number_of(p)], kept_.roots[number_of(q)]))
          continue;
        if (!std::ranges::binary_search(kept_.near, pair, {}, &NearPair::parts) &&
            !std::ranges::binary_search(kept_.turning, pair, {}, &NearPair::parts) &&
            !std::ranges::binary_search(kept_.apart, pair, {}, &ApartPair::parts))
          return broken("parts " + std::to_string(number_of(pair.a)) + " and " +
                        std::to_string(number_of(pair.b)) + " are near but have no front");
      }
    });
  }

  // All of b must lie beyond all of a, at both ends.
  void check_apart() {
    for_each_index(0, kept_.apart.size(), kept_.stop, [&](std::size_t i) {
      const ApartPair& pair = kept_.apart[i];
      const double separation =
          core_.arcs.widened(core_.thickness.between(core_.asked_separation, pair.parts.a, pair.parts.b),
                             pair.parts.a, pair.parts.b);
      const VertexMotion base = core_.motion.vertex(pair.parts.a, 0);
      for (const auto end : {&VertexMotion::t0, &VertexMotion::t1}) {
        const auto along = [&](PartId part, std::uint32_t v) {
          const VertexMotion vertex = core_.motion.vertex(part, v);
          double sum = 0;
          for (std::size_t k = 0; k < 3; ++k) sum += pair.direction[k] * ((vertex.*end)[k] - (base.*end)[k]);
          return sum;
        };
        double most = 0;
        for (std::uint32_t v = 0; v < core_.motion.vertex_count(pair.parts.a); ++v)
          most = std::max(most, along(pair.parts.a, v));
        for (std::uint32_t v = 0; v < core_.motion.vertex_count(pair.parts.b); ++v) {
          if (!(along(pair.parts.b, v) - most > separation))
            return broken("parts " + std::to_string(number_of(pair.parts.a)) + " and " +
                          std::to_string(number_of(pair.parts.b)) +
                          " are not apart along the direction that is stored");
        }
      }
    });
  }

  void check_front() {
    const std::span<const FrontSegment> segments = kept_.front->segments();
    if (!std::ranges::equal(segments, kept_.near, {}, &FrontSegment::parts, &NearPair::parts))
      return broken("the front's segments do not match the pairs of near parts");
    std::size_t size = 0;
    for (const FrontSegment& segment : segments) size += segment.size;
    if (size != kept_.front->size()) return broken("the front has a wrong pair count");
    tbb::parallel_for(std::size_t{0}, segments.size(), [&](std::size_t s) {
      const FrontSegment& segment = segments[s];
      if (!current(segment.parts.a) || !current(segment.parts.b)) return;
      const TreePair<Bounds> trees(kept_.trees[number_of(segment.parts.a)],
                                   kept_.trees[number_of(segment.parts.b)], GapAt::kEnd,
                                   kept_.widths.of(segment.parts));
      broken(segment, broken_cut(segment, trees));
      check_neighbours(segment);
      tbb::parallel_for(std::size_t{0}, segment.chunks.size(), [&](std::size_t c) {
        if (found_) return;
        kept_.stop.check();
        broken(segment, broken_chunk(segment.chunks[c], trees));
      });
    });
  }

  void check_neighbours(const FrontSegment& segment) {
    const PartId part = segment.parts.a;
    // None are listed where the front is not lazy, or has no room.
    if (!segment.with_itself() || !kept_.front->neighbours().listed(part)) return;
    broken(segment, broken_neighbours(kept_.front->neighbours().of(part), kept_.trees[number_of(part)],
                                      core_.topology->scene, core_.vertex_bounds,
                                      kept_.widths.of(segment.parts), kept_.turn, kept_.stop));
  }

  // Reports a fault, if there is one.
  void broken(const FrontSegment& segment, const std::string& fault) {
    if (fault.empty()) return;
    broken("the front of parts " + std::to_string(number_of(segment.parts.a)) + " and " +
           std::to_string(number_of(segment.parts.b)) + " " + fault);
  }

  const KeptState<Bounds>& kept_;
  const Core& core_;
  Finding found_;
};

}  // namespace

std::uint64_t checksum(const Core& core, StopSignal stop) {
  std::uint64_t sum = topology_checksum(*core.scene, *core.topology, stop);
  // Orphans of other parts may have been found for a change that was rolled back.
  for (std::size_t p = 0; p < core.orphans.size(); ++p) {
    if (core.orphans[p] != nullptr) sum += orphans_checksum(core.topology->parts[p], p, stop);
  }
  return sum;
}

template <class Bounds>
Status self_check(const KeptState<Bounds>& kept) {
  return SelfCheck<Bounds>(kept).run();
}
template Status self_check(const KeptState<Aabb>&);
template Status self_check(const KeptState<KDop18>&);

}  // namespace warmfront
