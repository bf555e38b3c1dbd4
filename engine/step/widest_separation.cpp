// SPDX-License-Identifier: Apache-2.0
#include "engine/step/widest_separation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/motion/longest_way.h"

namespace warmfront {

namespace {

constexpr double kMost = std::numeric_limits<double>::max();

}  // namespace

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
  const double least = keep.widest(longest, longest);
  double widest = keep.beyond;
  if (least > widest) widest += std::exp2(std::ceil(std::log2(least - widest)));
  return std::min(std::max(widest, least), kMost);
}

}  // namespace warmfront
