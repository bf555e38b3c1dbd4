// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/motion.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <string>
#include <utility>

#include "engine/motion/local_lanes.h"
#include "engine/motion/move_range.h"
#include "engine/motion/place.h"
#include "engine/motion/range_grains.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/part_way.h"
#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

/// The magnitude shrinks when it is so many times too large.
constexpr double kShrink = 8;

/// Lists of changed vertices longer than this share of a range are no gain.
constexpr std::size_t kListedShare = 16;

LocalTransform frame_of(std::span<const double> positions, StopSignal stop) {
  LocalTransform frame;
  double size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double lo = positions.empty() ? 0 : positions[axis];
    double hi = lo;
    in_pieces(0, positions.size() / 3, stop, [&](std::size_t first, std::size_t end) {
      for (std::size_t i = 3 * first + axis; i < 3 * end; i += 3) {
        lo = std::min(lo, positions[i]);
        hi = std::max(hi, positions[i]);
      }
    });
    frame.origin[axis] = lo / 2 + hi / 2;
    size = std::max(size, hi / 2 - lo / 2);
  }
  // A flat or pointlike scene still needs a scale: its own coordinates' magnitude.
  if (size == 0) {
    in_pieces(0, positions.size(), stop, [&](std::size_t first, std::size_t end) {
      for (std::size_t i = first; i < end; ++i) size = std::max(size, std::fabs(positions[i]));
    });
  }
  if (size > 0) {
    int exponent = 0;
    std::frexp(size, &exponent);
    frame.scale_a = std::ldexp(1.0, -exponent / 2);
    frame.scale_b = std::ldexp(1.0, -exponent - (-exponent / 2));
  }
  return frame;
}

// The greater one; not a number counts as beyond everything.
double at_least(double magnitude, double x) {
  if (std::fabs(x) <= magnitude) return magnitude;
  return std::isnan(x) ? std::numeric_limits<double>::infinity() : std::fabs(x);
}

bool same_bits(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

// Any vertex of the range may have moved, until it is known which did.
void expect_all(RangeMotion& range) {
  range.any = kMoving | kChanged;
  range.all = 0;
  range.changed.clear();
  range.listed = false;
}

}  // namespace

Motion::Motion(std::span<const double> positions, StopSignal stop) : frame_(frame_of(positions, stop)) {
  append(positions, stop);
}

double Motion::reach_of(const std::array<double, 3>& x) const {
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis)
    reach = at_least(reach, frame_.to_local(x[axis]) - frame_.to_local(frame_.origin[axis]));
  return reach;
}

void Motion::follow(double reach) {
  if (reach <= magnitude_ && !(reach < magnitude_ / kShrink)) return;
  int exponent = 0;
  std::frexp(reach, &exponent);
  magnitude_ = reach > 0 && std::isfinite(reach) ? std::ldexp(1.0, exponent) : reach;
}

void Motion::append(std::span<const double> positions, StopSignal stop) {
  const std::size_t more = positions.size() / 3;
  reserve(vertices_, vertices_.size() + more, stop);
  const auto take = [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
      const double* x = positions.data() + 3 * i;
      const std::array<double, 4> at{x[0], x[1], x[2], 0.0};
      vertices_.push_back({at, at});
    }
  };
  in_pieces(0, more, stop, take, kFreshAtOnce<VertexMotion>);
  lengthen(states_, vertices_.size(), MotionState{0}, stop);
}

Motion Motion::of_positions(std::span<const double> positions, StopSignal stop) const {
  Motion motion(std::span<const double>{}, stop);
  motion.frame_ = frame_;
  motion.magnitude_ = magnitude_;
  motion.append(positions, stop);
  return motion;
}

void Motion::make_room(std::size_t vertex_count, StopSignal stop) {
  make_room_for_runs(vertices_, vertex_count, stop);
  make_room_for_runs(states_, vertex_count, stop);
}

void Motion::splice(std::span<const Run> runs, std::size_t vertex_count) noexcept {
  move_runs(vertices_, runs, vertex_count);
  move_runs(states_, runs, vertex_count);
}

void Motion::take(const Motion& other, std::size_t first) noexcept {
  std::ranges::copy(other.vertices_, vertices_.begin() + static_cast<std::ptrdiff_t>(first));
  std::ranges::copy(other.states_, states_.begin() + static_cast<std::ptrdiff_t>(first));
}

void Motion::truncate(std::size_t vertex_count) {
  vertices_.resize(std::min(vertex_count, vertices_.size()));
  states_.resize(std::min(vertex_count, states_.size()));
}

void Motion::renumber(std::span<const GivenVertex> order, std::size_t first, StopSignal stop) {
  std::vector<VertexMotion> renumbered;
  renumbered.reserve(vertices_.size() - first);
  const auto take = [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) renumbered.push_back(vertices_[number_of(order[v])]);
  };
  in_pieces(first, vertices_.size(), stop, take, kFreshAtOnce<VertexMotion>);
  if (first == 0) {
    vertices_ = std::move(renumbered);
  } else {
    std::ranges::copy(renumbered, vertices_.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

template <class Real>
void Motion::move_all(std::uint32_t first, std::uint32_t end, From from, std::span<const Real> positions,
                      std::span<const GivenVertex> order, std::uint32_t first_row, RangeMotion& range,
                      StopSignal signal) {
  const Targets<Real> targets{positions.data(), order.data(), first_row, LocalLanes(frame_)};
  expect_all(range);
  const Moved moved =
      over_grains(first, end, range, signal, [&](std::uint32_t begin, std::uint32_t stop, Moved& sum) {
        move_range(from, targets, vertices_.data(), states_.data(), begin, stop, sum);
      });
  range.any = moved.any;
  range.all = first == end ? 0 : moved.all;
  range.reach = moved.reach;
  range.loose = false;
  range.listed = moved.any == 0;
}

void Motion::mark_changed(std::uint32_t first, std::uint32_t end, RangeMotion& range) noexcept {
  for (std::uint32_t v = first; v < end; ++v) {
    vertices_[v].t1 = vertices_[v].t0;
    states_[v] = kMoving | kChanged;
  }
  expect_all(range);
}

void Motion::rest(std::uint32_t first, std::uint32_t end, From from, RangeMotion& range, StopSignal stop) {
  const std::span<std::uint8_t> begun = begun_grains(range, grains_of(first, end));
  if (range.any != 0) stop_range(first, end, from, range, stop);
  std::ranges::fill(begun, std::uint8_t{1});  // to be undone from here on
}

void Motion::stop_range(std::uint32_t first, std::uint32_t end, From from, RangeMotion& range,
                        StopSignal signal) {
  const auto stop = [this, from](std::uint32_t v) {
    const bool moved = (states_[v] & kMoving) != 0;
    VertexMotion& vertex = vertices_[v];
    if (moved && from == From::kEnd) vertex.t0 = vertex.t1;
    if (moved && from == From::kStart) vertex.t1 = vertex.t0;
    return states_[v] = moved ? kChanged : 0;
  };
  if (range.listed) {
    std::erase_if(range.changed, [&](std::uint32_t v) { return stop(v) == 0; });
    range.any = range.changed.empty() ? 0 : kChanged;
    range.all = 0;
    return;
  }
  const Moved moved =
      over_range(first, end, range, signal, [&](std::uint32_t v, Moved& sum) { sum.add(stop(v)); });
  range.any = moved.any;
  range.all = moved.all;
  range.listed = moved.any == 0;
}

void Motion::move_one(std::uint32_t v, const std::array<double, 3>& to, RangeMotion& range) {
  VertexMotion& vertex = vertices_[v];
  const std::array<double, 4> x{to[0], to[1], to[2], 0.0};
  if (same_bits(x, vertex.t1)) return;
  if (range.listed && states_[v] == 0) {
    if (range.changed.size() >= vertices_.size() / kListedShare) {
      range.changed.clear();
      range.listed = false;
    } else {
      range.changed.push_back(v);
    }
  }
  const double reach = reach_of(to);
  range.loose |=
      reach < range.reach / 2 && !(reach_of({vertex.t1[0], vertex.t1[1], vertex.t1[2]}) < range.reach / 2);
  range.reach = std::max(range.reach, reach);
  vertex.t1 = x;
  states_[v] = kMoving | kChanged;
  range.any |= states_[v];
  range.all = 0;
}

void Motion::move_posed(std::uint32_t first, std::uint32_t end, std::span<const double> reference,
                        const Pose& from, const Pose& to, std::optional<From> at_from, RangeMotion& range,
                        StopSignal stop) {
  expect_all(range);
  const PlacedBy start(from);
  const PlacedBy goal(to);
  const Moved moved = over_range(first, end, range, stop, [&](std::uint32_t v, Moved& sum) {
    VertexMotion& vertex = vertices_[v];
    const double* x = reference.data() + std::size_t{3} * (v - first);
    if (at_from == From::kEnd) {
      vertex.t0 = vertex.t1;
    } else if (!at_from) {
      const auto x0 = start(x);
      vertex.t0 = {x0[0], x0[1], x0[2], 0.0};
    }
    const auto x1 = goal(x);
    vertex.t1 = {x1[0], x1[1], x1[2], 0.0};
    states_[v] = same_bits(vertex.t0, vertex.t1) ? kChanged : kMoving | kChanged;
    sum.add(states_[v]);
  });
  range.any = moved.any;
  range.all = first == end ? 0 : moved.all;
}

void Motion::undo(std::uint32_t first, std::uint32_t end, From from, RangeMotion& range) noexcept {
  const auto back = [this](std::uint32_t v) {
    if (states_[v] == 0) return;
    vertices_[v].t1 = vertices_[v].t0;
    states_[v] = kMoving | kChanged;  // so that the next step finds it changed
  };
  if (range.listed) {
    for (const std::uint32_t v : range.changed) back(v);
  } else if (from == From::kStart) {
    for (std::uint32_t v = first; v < end; ++v) back(v);
  } else {
    const std::uint32_t grains = grains_of(first, end);
    const std::span<const std::uint8_t> begun =
        grains <= 1 ? std::span<const std::uint8_t>(&range.only_grain_begun, grains) : range.begun;
    for (std::uint32_t grain = 0; grain < begun.size(); ++grain) {
      if (begun[grain] == 0) continue;
      const std::uint32_t begin = first + grain * kGrain;
      for (std::uint32_t v = begin; v < std::min(begin + kGrain, end); ++v) back(v);
    }
  }
  if (range.any != 0) range.any = kMoving | kChanged;
  range.all = 0;
}

void Motion::shorten(std::uint32_t first, std::uint32_t end, double fraction, bool single,
                     RangeMotion& range) noexcept {
  const auto shorten_one = [&](std::uint32_t v) {
    if ((states_[v] & kMoving) == 0) return;
    auto& [t0, t1] = vertices_[v];
    for (int axis = 0; axis < 3; ++axis) t1[axis] = part_way(t0[axis], t1[axis], fraction, single);
  };
  if (range.listed) {
    for (const std::uint32_t v : range.changed) shorten_one(v);
  } else {
    for (std::uint32_t v = first; v < end; ++v) shorten_one(v);
  }
}

void Motion::measure(std::uint32_t first, std::uint32_t end, RangeMotion& range, StopSignal stop) const {
  double reach = 0;
  in_pieces(first, end, stop, [&](std::size_t from, std::size_t to) {
    for (std::size_t v = from; v < to; ++v) {
      const auto& x = vertices_[v].t1;
      reach = std::max(reach, reach_of({x[0], x[1], x[2]}));
    }
  });
  range.reach = reach;
  range.loose = false;
}

template void Motion::move_all<float>(std::uint32_t, std::uint32_t, From, std::span<const float>,
                                      std::span<const GivenVertex>, std::uint32_t, RangeMotion&, StopSignal);
template void Motion::move_all<double>(std::uint32_t, std::uint32_t, From, std::span<const double>,
                                       std::span<const GivenVertex>, std::uint32_t, RangeMotion&, StopSignal);
}  // namespace warmfront
