// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/arcs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

// A part stays within a ball about its centre: what bends there, and what the ball's radius adds.
Arc arc_of(const SceneMotion::Poses& poses, const SceneMotion::Ball& ball) {
  Arc arc{twist_between(poses.start, poses.end)};
  const double angle_squared = arc.twist.angle_squared;
  if (angle_squared == 0) return arc;
  const std::array<double, 3> centre{ball.centre.t0[0], ball.centre.t0[1], ball.centre.t0[2]};
  std::array<double, 3> from_centre;
  for (std::size_t k = 0; k < 3; ++k) from_centre[k] = centre[k] - arc.twist.centre[k];
  const double rounding = rounding_of_bend(arc.twist, length_above(from_centre) + ball.radius);
  const double bend = length_above(arc.twist.bend_at(centre)) + angle_squared * ball.radius;
  arc.most = (bend / 8) * (1 + 0x1p-40) + 2 * rounding;
  if (!std::isfinite(arc.most)) arc.most = std::numeric_limits<double>::infinity();
  return arc;
}

}  // namespace

double length_above(const std::array<double, 3>& x) {
  const double most = std::max({std::fabs(x[0]), std::fabs(x[1]), std::fabs(x[2])});
  if (!(most > 0) || !std::isfinite(most)) return most == 0 ? 0 : std::numeric_limits<double>::infinity();
  // Where no square overflows, nor one that counts is subnormal, the same without the powers of two, which
  // round nothing.
  if (most > 0x1p-400 && most < 0x1p400) {
    const double square = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    return std::sqrt(square) * (1 + 0x1p-48) + std::numeric_limits<double>::denorm_min();
  }
  const int exponent = std::ilogb(most);
  double square = 0;
  for (const double c : x) {
    const double scaled = std::ldexp(c, -exponent);
    square += scaled * scaled;
  }
  return std::ldexp(std::sqrt(square) * (1 + 0x1p-48), exponent) + std::numeric_limits<double>::denorm_min();
}

// Of the terms of a bend some ten roundings take a share each, and the shares of an arc are off by 2^-50.
double rounding_of_bend(const Twist& twist, double from_centre) {
  const double angle = std::sqrt(twist.angle_squared) * (1 + 0x1p-48);
  return 0x1p-46 * (angle * (angle * from_centre + length_above(twist.linear))) + 0x1p-1060;
}

void Arcs::take(std::span<const PartId> screws, std::span<const std::uint32_t> body_of_vertex,
                const SceneMotion& motion, StopSignal stop) {
  any_ = false;
  PacedStop paced(stop);
  for (const PartId part : screws) {
    paced.check();
    if (!motion.turns(part)) continue;
    if (!any_) {
      of_part_.assign(motion.part_count(), Arc{});
      body_of_vertex_ = body_of_vertex;
      any_ = true;
    }
    of_part_[number_of(part)] = arc_of(motion.poses(part), motion.ball(part));
  }
}

}  // namespace warmfront
