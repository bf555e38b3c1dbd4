// SPDX-License-Identifier: Apache-2.0
#include "engine/step/half_space_stage.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/narrow_phase/pair_tester.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {
namespace {

/// Vertices that are worth a task of their own: some 5 microseconds.
constexpr std::uint32_t kVertices = 2048;

/// In the local frame, the half-space and how far parts must stay from it. Conservative: what lies beyond is
/// reported by no elementary test (HalfSpaceFilter).
class LocalPlane {
 public:
  LocalPlane(const HalfSpaceMotion& half_space, const LocalTransform& frame, double separation) {
    double largest = 0;
    for (const auto& n : half_space.normal) {
      for (const double x : n) largest = std::max(largest, std::fabs(x));
    }
    if (!(largest > 0) || !std::isfinite(largest)) {
      reach_ = std::numeric_limits<double>::infinity();  // nothing is clear
      return;
    }
    const int exponent = std::ilogb(largest);
    double length = 0;
    for (std::size_t end = 0; end < 2; ++end) {
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        normal_[end][k] = std::ldexp(half_space.normal[end][k], -exponent);
        point_[end][k] = frame.to_local(half_space.point[end][k] - frame.origin[k]);
        square += normal_[end][k] * normal_[end][k];
        reach_ = std::max(reach_, std::fabs(point_[end][k]));
      }
      length = std::max(length, std::sqrt(square));
    }
    const double local = frame.to_local(separation);
    reach_ += local;
    beyond_ = separation == 0 ? 0 : local * length;
  }

  /// Is all that the bounds hold beyond? The least of the Bernstein coefficients of n . (x - p) over the
  /// bounds at either end is no more than that of any point in them.
  template <class Bounds>
  bool clear(const Bounds& bounds) const {
    double size = reach_;
    std::array<std::array<double, 3>, 2> lower;
    std::array<std::array<double, 3>, 2> upper;
    for (std::size_t end = 0; end < 2; ++end) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t lane = end * Bounds::kEnd + k;
        lower[end][k] = bounds.lane[lane];
        upper[end][k] = -bounds.lane[lane + Bounds::kAxes];
        size = std::max({size, reach_ + std::fabs(lower[end][k]), reach_ + std::fabs(upper[end][k])});
      }
    }
    const auto least = [&](std::size_t n, std::size_t x) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double nk = normal_[n][k];
        sum += nk * ((nk < 0 ? upper[x][k] : lower[x][k]) - point_[x][k]);
      }
      return sum;
    };
    constexpr double kMargin = 0x1p-38;  // of a normal that is at most 2 in each coordinate
    const double margin = beyond_ + kMargin * size;
    // What is not a number is not clear.
    return least(0, 0) > margin && least(1, 1) > margin && 0.5 * (least(0, 1) + least(1, 0)) > margin &&
           size < std::numeric_limits<float>::max();
  }

 private:
  std::array<std::array<double, 3>, 2> normal_{};
  std::array<std::array<double, 3>, 2> point_{};
  double reach_ = 0;
  double beyond_ = 0;
};

HalfSpaceMotion motion_of(const Core& core, PartId part, const HalfSpace& at_rest) {
  const auto [start, end] = core.motion.poses(part);
  const auto turned = [](Pose pose, const HalfSpace& of) {
    for (const int translation : {3, 7, 11}) pose.matrix[translation] = 0;
    return pose.place(of.normal.data());
  };
  // At the identity nothing is rounded, and no 0 changes its sign.
  const auto point = [&](const Pose& pose) {
    return pose == Pose{} ? at_rest.point : pose.place(at_rest.point.data());
  };
  const auto normal = [&](const Pose& pose) {
    return pose == Pose{} ? at_rest.normal : turned(pose, at_rest);
  };
  return {{point(start), point(end)}, {normal(start), normal(end)}};
}

// Half-spaces are few: of a scene's thousand bodies one or two.
const CollisionModel::HalfSpaceOf& found(const Core& core, PartId part) {
  const auto all = core.model.half_spaces();
  return *std::ranges::lower_bound(all, part, {}, &CollisionModel::HalfSpaceOf::part);
}

}  // namespace

HalfSpaceMotion half_space_now(const Core& core, std::uint32_t body) {
  const PartId part = part_of_body(body);
  return motion_of(core, part, found(core, part).at_rest);
}

VertexMotion vertex_now(const Core& core, std::uint32_t v) {
  const PartId part = core.motion.part_of(v);
  return core.motion.vertex(part, v - core.motion.first_vertex(part));
}

template <class Bounds>
void HalfSpaceStage::find_tasks(const Core& core, const CollisionModel::HalfSpaceOf& half_space,
                                const HalfSpaceMotion& motion, std::span<const Bounds> roots,
                                StopSignal stop) {
  tasks_.clear();
  PacedStop paced(stop);
  const LocalTransform& frame = core.motion.vertices().frame();
  const bool own_each = core.thickness.any() || core.arcs.any();
  // A share of each vertex's own distance says nothing of a part.
  const bool culls = !roots.empty() && core.keep.share == 0;
  const LocalPlane thin(motion, frame, core.options.min_separation);
  const auto clear = [&](PartId part) {
    if (!own_each) return thin.clear(roots[number_of(part)]);
    const double separation = core.arcs.widened(
        core.thickness.between(core.options.min_separation, part, half_space.part), part, half_space.part);
    return LocalPlane(motion, frame, separation).clear(roots[number_of(part)]);
  };
  for (PartId part{0}; part < core.model.end_part(); ++part) {
    paced.check();
    const std::uint32_t count = core.motion.vertex_count(part);
    if (count == 0 || !core.model.may_meet(half_space, part) || (culls && clear(part))) continue;
    for (std::uint32_t first = 0; first < count; first += kVertices)
      tasks_.push_back({part, first, std::min(count, first + kVertices)});
  }
}

namespace {

// Vertices [first, end) of a part.
void test(const Core& core, const CollisionModel::HalfSpaceOf& half_space, const HalfSpaceMotion& motion,
          PartId part, std::uint32_t first, std::uint32_t end, PairTester& tester) {
  const ColliderOptions& options = core.options;
  const double widest = core.arcs.widened(
      core.thickness.between(options.min_separation, part, half_space.part), part, half_space.part);
  const std::optional<Instant> at =
      options.pair_test == PairTest::kMotion ? std::nullopt : std::optional(options.instant);
  const HalfSpaceFilter filter(motion, widest, at);
  const bool filters = core.keep.share == 0;
  const std::uint32_t first_of_part = core.motion.first_vertex(part);
  const auto take = [&](std::uint32_t v, const VertexMotion& vertex) {
    if (filters && filter.clear(vertex)) return;
    tester.vertex_half_space(v, vertex, motion, body_of_part(half_space.part), half_space.thickness);
  };
  if (core.motion.unplaced(part)) {
    for (std::uint32_t i = first; i < end; ++i) take(first_of_part + i, core.motion.vertex(part, i));
    return;
  }
  const std::span<const VertexMotion> vertices = core.motion.vertices().vertices();
  for (std::uint32_t v = first_of_part + first; v < first_of_part + end; ++v) take(v, vertices[v]);
}

}  // namespace

template <class Bounds>
void HalfSpaceStage::run(const Core& core, std::span<const Bounds> roots, NarrowPhase<Bounds>& narrow,
                         StopSignal stop) {
  if (core.options.pair_test == PairTest::kIntersection) return;
  for (const CollisionModel::HalfSpaceOf& half_space : core.model.half_spaces()) {
    const HalfSpaceMotion motion = motion_of(core, half_space.part, half_space.at_rest);
    find_tasks(core, half_space, motion, roots, stop);
    const auto run_task = [&](std::size_t i) {
      const Task& task = tasks_[i];
      test(core, half_space, motion, task.part, task.first, task.end, narrow.tester());
    };
    for_each_index(0, tasks_.size(), stop, run_task, 1);
  }
}

template void HalfSpaceStage::run(const Core&, std::span<const Aabb>, NarrowPhase<Aabb>&, StopSignal);
template void HalfSpaceStage::run(const Core&, std::span<const KDop18>, NarrowPhase<KDop18>&, StopSignal);

std::size_t HalfSpaceStage::memory_bytes() const {
  return held_bytes(tasks_);
}

}  // namespace warmfront
