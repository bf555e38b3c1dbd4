// SPDX-License-Identifier: Apache-2.0
// The pose of a rigid body. Plain values and pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "engine/result.h"

namespace warmfront {

/// A 3x4 matrix [R t], row-major: a vertex at reference position x is placed at R x + t. Within a step
/// vertices move linearly from one pose to the next.
struct Pose {
  std::array<double, 12> matrix{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  /// ((R_0 x_0 + R_1 x_1) + R_2 x_2) + t, each operation rounded once, so that every machine computes the
  /// same bits; of the identity x itself, of which the sum would make 0 where it is -0. Out of line: compiled
  /// into a caller, a product and a sum may become one instruction that rounds once for both.
  std::array<double, 3> place(const double* x) const;

  friend bool operator==(const Pose&, const Pose&) = default;
};

/// The pose with each number rounded to the nearest float32, as poses are sent in a float32 session. Out of
/// line: when inlined, GCC 12 at -O3 omits some of the roundings.
Pose in_float32(const Pose& pose);

/// Maximum entry of |R^T R - I|: float32 matrices pass.
inline constexpr double kPoseTolerance = 1e-5;

/// Which matrices pass: rotations, or also what is part of the way from one to another (part_way.h, screw.h),
/// which lengthens nothing by more than 2^-13: what passes as a rotation passes as that.
enum class PoseCheck : std::uint8_t { kRigid, kPartWay };

/// kInvalidArgument, in words that begin with `where`, for a matrix that is not finite, or whose R is no
/// rotation (scaled, sheared or mirrored); kPartWay: whose R lengthens something.
Status check_pose(const Pose& pose, const std::string& where, PoseCheck check = PoseCheck::kRigid);

}  // namespace warmfront
