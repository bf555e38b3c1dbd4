// SPDX-License-Identifier: Apache-2.0
#include "engine/step/widest_separation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "engine/motion/longest_way.h"
#include "engine/step/half_space_stage.h"

namespace warmfront {

namespace {

constexpr double kMost = std::numeric_limits<double>::max();

/// Edges that are looked at.
constexpr std::size_t kSome = 256;

// At the start, of some the one in the middle: a scene may have few that are much longer.
double length_of_edges(const Core& core) {
  const std::span<const Edge> edges = core.topology->scene.edges();
  const std::size_t apart = edges.size() / kSome + 1;
  std::array<double, kSome> lengths;
  std::size_t count = 0;
  for (std::size_t i = 0; i < edges.size(); i += apart) {
    const VertexMotion from = vertex_now(core, edges[i][0]);
    const VertexMotion to = vertex_now(core, edges[i][1]);
    lengths[count++] = way_of({from.t0, to.t0});
  }
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(lengths.begin(), middle, lengths.begin() + static_cast<std::ptrdiff_t>(count));
  return count > 0 && *middle < kMost ? *middle : 0;
}

}  // namespace

double narrowed_separation(Core& core, double widest) {
  if (core.keep.share == 0 || core.arcs.any()) return widest;
  return core.window.narrow(widest, beyond_with_room(core), length_of_edges(core));
}

double beyond_with_room(const Core& core) {
  const double beyond = core.keep.beyond;
  const double widest_asked = beyond + 2 * core.thickness.most();
  const double room = CommitRoom::kAway * core.room.most(widest_asked);
  return room > 0 ? std::min(beyond + std::exp2(std::ceil(std::log2(room))), kMost) : beyond;
}

double widest_separation(const Core& core, StopSignal stop) {
  KeepDistance keep = core.keep;
  keep.beyond = beyond_with_room(core);
  if (keep.share == 0) return keep.beyond;
  const double longest = longest_way(core.motion, core.arcs, stop);
  double least = keep.widest(longest, longest);
  // See elementary/README.md, "Each pair's own separation": up to a time.
  if (const double until = core.window.latest(); until < 1 && !core.arcs.any()) {
    const double size = 8 * core.motion.vertices().frame().to_scene(core.motion.vertices().magnitude());
    const double way = (longest * until + size * 0x1p-18) * (1 + 0x1p-5);
    least = std::min(least, keep.widest(way, way));
  }
  double widest = keep.beyond;
  if (least > widest) widest += std::exp2(std::ceil(std::log2(least - widest)));
  return std::min(std::max(widest, least), kMost);
}

}  // namespace warmfront
