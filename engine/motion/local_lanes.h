// SPDX-License-Identifier: Apache-2.0
// Positions into the local frame, the axes side by side. Only for sources that dispatch by instruction set.
#pragma once

#include "engine/motion/motion.h"
#include "engine/simd/lanes.h"

namespace warmfront {

/// The same bits as LocalTransform::to_local() of a position less that of the origin; the fourth lane stays
/// 0.
class LocalLanes {
 public:
  explicit LocalLanes(const LocalTransform& frame)
      : scale_a_(Double4{} + frame.scale_a),
        scale_b_(Double4{} + frame.scale_b),
        origin_{frame.to_local(frame.origin[0]), frame.to_local(frame.origin[1]),
                frame.to_local(frame.origin[2])} {}

  WARMFRONT_INLINE Double4 operator()(Double4 position) const {
    return position * scale_a_ * scale_b_ - origin_;
  }

 private:
  Double4 scale_a_;
  Double4 scale_b_;
  Double4 origin_;
};

}  // namespace warmfront
