// SPDX-License-Identifier: Apache-2.0
#include "engine/step/widest_separation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/motion/longest_way.h"

namespace warmfront {

double widest_separation(const Core& core, StopSignal stop) {
  constexpr double kMost = std::numeric_limits<double>::max();
  KeepDistance keep = core.keep;
  const double widest_asked = keep.beyond + 2 * core.thickness.most();
  if (const double room = CommitRoom::kAway * core.room.most(widest_asked); room > 0)
    keep.beyond = std::min(keep.beyond + std::exp2(std::ceil(std::log2(room))), kMost);
  if (keep.share == 0) return keep.beyond;
  const double longest = longest_way(core.motion, core.arcs, stop);
  const double least = keep.widest(longest, longest);
  double widest = keep.beyond;
  if (least > widest) widest += std::exp2(std::ceil(std::log2(least - widest)));
  return std::min(std::max(widest, least), kMost);
}

}  // namespace warmfront
