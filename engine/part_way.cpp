// SPDX-License-Identifier: Apache-2.0
#include "engine/part_way.h"

#include <cmath>

namespace warmfront {

double part_way(double from, double to, double fraction, bool single) {
  if (fraction == 1) return to;
  if (fraction == 0) return from;
  const double difference = to - from;
  const double at =
      std::isfinite(difference) ? from + fraction * difference : (1 - fraction) * from + fraction * to;
  if (!single) return at;
  const volatile float rounded = static_cast<float>(at);
  return rounded;
}

Pose part_way(const Pose& from, const Pose& to, double fraction, bool single) {
  Pose pose;
  for (std::size_t i = 0; i < pose.matrix.size(); ++i)
    pose.matrix[i] = part_way(from.matrix[i], to.matrix[i], fraction, single);
  return pose;
}

}  // namespace warmfront
