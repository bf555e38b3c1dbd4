// SPDX-License-Identifier: Apache-2.0
#include "engine/step/widest_separation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/motion/longest_way.h"

namespace warmfront {

double widest_separation(const Core& core, StopSignal stop) {
  const double longest = longest_way(core.motion, core.arcs, stop);
  const double least = core.keep.widest(longest, longest);
  double widest = core.keep.beyond;
  if (least > widest) widest += std::exp2(std::ceil(std::log2(least - widest)));
  return std::min(std::max(widest, least), std::numeric_limits<double>::max());
}

}  // namespace warmfront
