// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/motion.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace warmfront {
namespace {

LocalFrame frame_of(std::span<const double> positions) {
  LocalFrame frame;
  double size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double lo = positions.empty() ? 0 : positions[axis];
    double hi = lo;
    for (std::size_t i = axis; i < positions.size(); i += 3) {
      lo = std::min(lo, positions[i]);
      hi = std::max(hi, positions[i]);
    }
    frame.origin[axis] = lo / 2 + hi / 2;
    size = std::max(size, hi / 2 - lo / 2);
  }
  // A flat or pointlike scene still needs a scale: its own coordinates' magnitude.
  if (size == 0) {
    for (const double x : positions) size = std::max(size, std::fabs(x));
  }
  if (size > 0) {
    int exponent = 0;
    std::frexp(size, &exponent);
    frame.scale_a = std::ldexp(1.0, -exponent / 2);
    frame.scale_b = std::ldexp(1.0, -exponent - (-exponent / 2));
  }
  return frame;
}

}  // namespace

Motion::Motion(std::span<const double> positions)
    : vertices_(positions.size() / 3), frame_(frame_of(positions)) {
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    const double* x = positions.data() + 3 * v;
    vertices_[v].t0 = vertices_[v].t1 = {x[0], x[1], x[2], 0.0};
  }
}

void Motion::set(std::span<const double> x0, std::span<const double> x1,
                 std::span<const std::uint32_t> order) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices_.size(), 8192), [&](const auto& range) {
    for (std::size_t v = range.begin(); v < range.end(); ++v) {
      const double* a = x0.data() + 3 * (order.empty() ? v : order[v]);
      const double* b = x1.data() + 3 * (order.empty() ? v : order[v]);
      vertices_[v].t0 = {a[0], a[1], a[2], 0.0};
      vertices_[v].t1 = {b[0], b[1], b[2], 0.0};
    }
  });
}

template <class Real>
Status check_positions(std::span<const Real> positions, std::uint32_t vertex_count) {
  const std::size_t expected = std::size_t{3} * vertex_count;
  if (positions.size() != expected) {
    return invalid_argument("positions: " + std::to_string(positions.size()) + " values where " +
                            std::to_string(expected) + " are expected (3 for each of " +
                            std::to_string(vertex_count) + " vertices)");
  }
  for (std::size_t i = 0; i < expected; ++i) {
    if (!std::isfinite(positions[i])) {
      return invalid_argument("positions[" + std::to_string(i / 3) + "]." + "xyz"[i % 3] + ": is " +
                              (std::isnan(positions[i]) ? "not a number" : "infinite") +
                              "; coordinates must be finite");
    }
  }
  return {};
}

template Status check_positions<float>(std::span<const float>, std::uint32_t);
template Status check_positions<double>(std::span<const double>, std::uint32_t);

}  // namespace warmfront
