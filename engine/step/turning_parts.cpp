// SPDX-License-Identifier: Apache-2.0
// Where the parts of the stage are in the pieces of a step.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/elementary/certified.h"
#include "engine/elementary/turning_search.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/step/turning_stage.h"
#include "engine/step/widest_separation.h"

namespace warmfront {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr ChordBox kNowhere{{kInfinity, kInfinity, kInfinity, 0}, {-kInfinity, -kInfinity, -kInfinity, 0}};

template <std::size_t N>
Corner corner(const std::array<double, N>& x) {
  return {x[0], x[1], x[2], 0};
}

ArcPath corners_of(const turning::Path& path) {
  return {corner(path.start), corner(path.way), corner(path.bend), corner(path.turn)};
}

}  // namespace

// In the order of the parts, so that the same scene has the same positions held. What steps before have left
// is kept while all of it has room: a warm step allocates nothing.
void TurningStage::share_room(const Core& core) {
  const std::size_t most = core.options.max_front_bytes / kPositionsShare / sizeof(Corner);
  std::size_t given = 0;
  std::size_t held = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Part& part = parts_[i];
    std::size_t count = 0;
    if (i < part_count_) {
      count = core.motion.vertex_count(part.part) * (static_cast<std::size_t>(pieces_) + 1);
      part.holds = core.arcs.of_part(part.part) != nullptr && count <= most - given;
      if (!part.holds) count = 0;
    }
    given += count;
    held += std::max(count, part.at.capacity());
  }
  if (held <= most) return;
  for (Part& part : parts_) part.at = {};
}

void TurningStage::place(const Core& core, Part& part, StopSignal stop) const {
  const std::uint32_t first = core.motion.first_vertex(part.part);
  const std::uint32_t count = core.motion.vertex_count(part.part);
  const Twist* twist = core.arcs.of_part(part.part);
  const std::span<const VertexMotion> vertices = core.motion.vertices().vertices();
  part.rests = (core.motion.state(part.part) & kMoving) == 0;
  part.bounded = false;
  part.corners.clear();
  const auto times = static_cast<std::size_t>(pieces_) + 1;
  part.at.resize(part.holds ? count * times : 0);
  part.at_times.assign(times, kNowhere);
  double bend = 0;
  PacedStop paced(stop);
  if (twist != nullptr) {
    std::array<ArcTime, kMostPiecesOfStep> before_end;
    for (std::size_t k = 0; k + 1 < times; ++k)
      before_end[k] = {time_of(k), turning::shares_at(twist, time_of(k))};
    std::array<Corner, kMostPiecesOfStep + 1> of_vertex;
    const std::size_t stride = part.holds ? count : 1;
    for (std::uint32_t v = 0; v < count; ++v) {
      paced.check();
      const turning::Path path(vertices[first + v], twist, {});
      bend = std::max(bend, length_above(path.bend));
      Corner* const at = part.holds ? &part.at[v] : of_vertex.data();
      along_arc(corners_of(path), {before_end.data(), times - 1}, at, stride);
      at[(times - 1) * stride] = corner(vertices[first + v].t1);
      if (part.holds) continue;
      for (std::size_t k = 0; k < times; ++k) add(part.at_times[k], {at[k], at[k]});
    }
    if (part.holds) {
      for (std::size_t k = 0; k < times; ++k)
        add(part.at_times[k], around_points(std::span<const Corner>(part.at).subspan(k * count, count)));
    }
  } else {
    for (std::size_t k = 0; k < times; ++k) {
      for (std::uint32_t v = 0; v < count; ++v) {
        paced.check();
        const Corner at = position(core, part, v, static_cast<int>(k));
        add(part.at_times[k], {at, at});
      }
    }
  }
  const Box& all = part.ever = around(part.at_times);
  part.size = 0;
  part.reach = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    part.size = std::max(part.size, all.high[axis] - all.low[axis]);
    part.reach = std::max({part.reach, std::fabs(all.low[axis]), std::fabs(all.high[axis])});
  }
  const double width = 1.0 / pieces_;
  part.away = (width * width * bend / 8) * (1 + 0x1p-40) + core.arcs.most_of(part.part) * 0x1p-40 +
              part.reach * 0x1p-48;
  part.size += bend;
}

// How far apart boxes of two parts must be before nothing of them is reported. L of turning_test() is no more
// than all coordinates of both; shorter chords are as far from an arc as their own share of its bend says.
// Sums and differences of coordinates round by 2^-51 of the reach, of which there are 2^-47.
KeptRoom TurningStage::room_between(const Core& core, const Part& a, const Part& b) const {
  const ColliderOptions& options = core.options;
  const double separation = core.thickness.between(options.min_separation, a.part, b.part);
  const double allowed = 4 * certified_reach(options.tolerance) + 2 * options.tolerance;
  const double length = 2 * (a.size + b.size) + 0x1p-40 * std::max(a.reach, b.reach);
  KeepDistance keep = core.keep;
  if (keep.share > 0) keep.beyond = core.thickness.between(beyond_with_room(core), a.part, b.part);
  return {keep, separation, 2 * (a.away + b.away) + allowed * length, allowed};
}

// A scene may have large parts that a turning one is near: only those that turn hold their positions.
Corner TurningStage::position(const Core& core, const Part& part, std::uint32_t v, int time) const {
  if (!part.at.empty())
    return part.at[static_cast<std::size_t>(time) * core.motion.vertex_count(part.part) + v];
  const VertexMotion& vertex = core.motion.vertices().vertices()[core.motion.first_vertex(part.part) + v];
  const auto& [t0, t1] = vertex;
  if (time == pieces_) return corner(t1);
  const double s = time_of(static_cast<std::size_t>(time));
  if (const Twist* twist = core.arcs.of_part(part.part)) {
    const ArcTime when{s, turning::shares_at(twist, s)};
    Corner at;
    along_arc(corners_of(turning::Path(vertex, twist, {})), {&when, 1}, &at, 1);
    return at;
  }
  return {t0[0] + s * (t1[0] - t0[0]), t0[1] + s * (t1[1] - t0[1]), t0[2] + s * (t1[2] - t0[2]), 0};
}

TurningStage::Box TurningStage::box_of(const Core& core, const Part& part,
                                       const std::array<std::uint32_t, 3>& corners, int piece) const {
  std::array<Corner, 6> ends;
  for (std::size_t i = 0; i < 3; ++i) {
    ends[2 * i] = position(core, part, corners[i], piece);
    ends[2 * i + 1] = position(core, part, corners[i], piece + 1);
  }
  return around_points(ends);
}

// Between two primitives, for each of their pairs of features.
double TurningStage::room_of(const Core& core, const Part& f, std::uint32_t place_f, const Part& g,
                             std::uint32_t place_g, const KeptRoom& room) const {
  if (!room.differs()) return room.most();
  Corners of_f;
  Corners of_g;
  for (std::size_t i = 0; i < 3; ++i) {
    of_f[i] = position(core, f, f.corners[place_f][i], 0);
    of_g[i] = position(core, g, g.corners[place_g][i], 0);
  }
  return room.of(of_f, of_g);
}

// Of two faces, from a piece on before which their boxes are apart, to the last that begins by `latest`; all,
// where nothing is told of boxes.
std::uint32_t TurningStage::near_features_of(const Core& core, const Part& f, std::uint32_t place_f,
                                             const Part& g, std::uint32_t place_g, int piece, double latest,
                                             double room) const {
  if (!(f.reach < kMostReach && g.reach < kMostReach)) return ~0U;
  using Times = std::array<std::array<Corner, 3>, kMostPiecesOfStep + 1>;
  Times of_f;
  Times of_g;
  std::size_t times = 0;
  const auto begins = [this](int k) { return time_of(static_cast<std::size_t>(k)); };
  for (int k = piece; k <= pieces_ && (k <= piece + 1 || begins(k - 1) <= latest); ++k, ++times) {
    for (std::size_t i = 0; i < 3; ++i) {
      of_f[times][i] = position(core, f, f.corners[place_f][i], k);
      of_g[times][i] = position(core, g, g.corners[place_g][i], k);
    }
  }
  return near_features({of_f.data(), times}, {of_g.data(), times}, room);
}

}  // namespace warmfront
