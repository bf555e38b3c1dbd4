// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/move_range.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

// Where a vertex is before a question that begins from there, and its other end.
template <From kFrom>
WARMFRONT_INLINE std::array<double, 4>& before(VertexMotion& vertex) {
  return kFrom == From::kEnd ? vertex.t1 : vertex.t0;
}
template <From kFrom>
WARMFRONT_INLINE std::array<double, 4>& beyond(VertexMotion& vertex) {
  return kFrom == From::kEnd ? vertex.t0 : vertex.t1;
}

// See Motion::move_all().
template <From kFrom, class Real>
WARMFRONT_INLINE void move_each(const Targets<Real>& targets, VertexMotion* vertices, MotionState* states,
                                std::uint32_t begin, std::uint32_t end, Moved& sum) {
  Double4 largest{};
  Long4 no_number{};
  for (std::uint32_t v = begin; v < end; ++v) {
    const Real* to = targets.positions + std::size_t{3} * (number_of(targets.order[v]) - targets.first_row);
    const Double4 x{to[0], to[1], to[2]};
    Double4 at;
    std::memcpy(&at, before<kFrom>(vertices[v]).data(), sizeof at);
    MotionState state = 0;
    if ((states[v] & kMoving) != 0) {
      std::memcpy(beyond<kFrom>(vertices[v]).data(), &at, sizeof at);
      state = kChanged;
    }
    const Long4 differs = (Long4)x ^ (Long4)at;
    if ((differs[0] | differs[1] | differs[2]) != 0) {
      std::memcpy(vertices[v].t1.data(), &x, sizeof x);
      state = kMoving | kChanged;
    }
    const Double4 local = targets.to_local(x);
    const Double4 size = select(local < 0.0, -local, local);
    largest = greater(size, largest);
    no_number |= size != size;
    states[v] = state;
    sum.add(state);
  }
  const bool numbers = (no_number[0] | no_number[1] | no_number[2]) == 0;
  for (int axis = 0; axis < 3; ++axis) sum.reach = std::max(sum.reach, largest[axis]);
  if (!numbers) sum.reach = std::numeric_limits<double>::infinity();
}

}  // namespace

WARMFRONT_TARGET_CLONES
void move_range(From from, const Targets<float>& targets, VertexMotion* vertices, MotionState* states,
                std::uint32_t begin, std::uint32_t end, Moved& sum) {
  if (from == From::kEnd)
    move_each<From::kEnd>(targets, vertices, states, begin, end, sum);
  else
    move_each<From::kStart>(targets, vertices, states, begin, end, sum);
}

WARMFRONT_TARGET_CLONES
void move_range(From from, const Targets<double>& targets, VertexMotion* vertices, MotionState* states,
                std::uint32_t begin, std::uint32_t end, Moved& sum) {
  if (from == From::kEnd)
    move_each<From::kEnd>(targets, vertices, states, begin, end, sum);
  else
    move_each<From::kStart>(targets, vertices, states, begin, end, sum);
}

}  // namespace warmfront
