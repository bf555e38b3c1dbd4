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
#include "engine/parallel/stoppable_loops.h"
#include "engine/part_way.h"
#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

/// Vertices of a task.
constexpr std::uint32_t kGrain = 8192;

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

std::uint32_t grains_of(std::uint32_t first, std::uint32_t end) {
  return (end - first + kGrain - 1) / kGrain;
}

// RangeMotion::begun, with room for so many grains.
std::span<std::uint8_t> begun_grains(RangeMotion& range, std::uint32_t grains) {
  if (grains <= 1) return {&range.only_grain_begun, grains};
  range.begun.resize(grains);
  return range.begun;
}

// Any vertex of the range may have moved, until it is known which did.
void expect_all(RangeMotion& range) {
  range.any = kMoving | kChanged;
  range.all = 0;
  range.changed.clear();
  range.listed = false;
}

// What a grain of a range came to.
struct Moved {
  MotionState any = 0;
  MotionState all = kMoving | kChanged;
  double reach = 0;

  void add(MotionState state) {
    any |= state;
    all &= state;
  }
  void add(const Moved& other) {
    any |= other.any;
    all &= other.all;
    reach = std::max(reach, other.reach);
  }
};

// What of_grain(begin, end, moved) adds for all grains of a range; each is marked as begun before. Looks at
// the flag before each, so that what was begun is done.
template <class OfGrain>
Moved over_grains(std::uint32_t first, std::uint32_t end, RangeMotion& range, StopSignal stop,
                  OfGrain&& of_grain) {
  const std::uint32_t grains = grains_of(first, end);
  const std::span<std::uint8_t> begun = begun_grains(range, grains);
  std::ranges::fill(begun, std::uint8_t{0});
  Moved sum;
  if (grains <= 1) {  // one of many small bodies: a task costs as much as its vertices
    stop.check();
    std::ranges::fill(begun, std::uint8_t{1});
    of_grain(first, end, sum);
    return sum;
  }
  std::mutex mutex;
  tbb::parallel_for(std::uint32_t{0}, grains, [&](std::uint32_t grain) {
    stop.check();
    const std::uint32_t begin = first + grain * kGrain;
    begun[grain] = 1;
    Moved moved;
    of_grain(begin, std::min(begin + kGrain, end), moved);
    const std::lock_guard lock(mutex);
    sum.add(moved);
  });
  return sum;
}

// Runs of_vertex(v, moved) for all vertices of a range.
template <class OfVertex>
Moved over_range(std::uint32_t first, std::uint32_t end, RangeMotion& range, StopSignal stop,
                 OfVertex&& of_vertex) {
  return over_grains(first, end, range, stop,
                     [&](std::uint32_t grain, std::uint32_t grain_end, Moved& moved) {
                       for (std::uint32_t v = grain; v < grain_end; ++v) of_vertex(v, moved);
                     });
}

// Where vertices go, and what it takes to bring that into the local frame.
template <class Real>
struct Targets {
  const Real* positions;
  const std::uint32_t* order;
  std::uint32_t first_row;
  LocalLanes to_local;
};

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
    const Real* to = targets.positions + std::size_t{3} * (targets.order[v] - targets.first_row);
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
    const Double4 size = local < 0.0 ? -local : local;
    largest = size > largest ? size : largest;
    no_number |= size != size;
    states[v] = state;
    sum.add(state);
  }
  const bool numbers = (no_number[0] | no_number[1] | no_number[2]) == 0;
  for (int axis = 0; axis < 3; ++axis) sum.reach = std::max(sum.reach, largest[axis]);
  if (!numbers) sum.reach = std::numeric_limits<double>::infinity();
}

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

void Motion::truncate(std::size_t vertex_count) {
  vertices_.resize(std::min(vertex_count, vertices_.size()));
  states_.resize(std::min(vertex_count, states_.size()));
}

void Motion::renumber(std::span<const std::uint32_t> order, std::size_t first, StopSignal stop) {
  std::vector<VertexMotion> renumbered;
  renumbered.reserve(vertices_.size() - first);
  const auto take = [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) renumbered.push_back(vertices_[order[v]]);
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
                      std::span<const std::uint32_t> order, std::uint32_t first_row, RangeMotion& range,
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
  const Moved moved = over_range(first, end, range, stop, [&](std::uint32_t v, Moved& sum) {
    VertexMotion& vertex = vertices_[v];
    const double* x = reference.data() + std::size_t{3} * (v - first);
    if (at_from == From::kEnd) {
      vertex.t0 = vertex.t1;
    } else if (!at_from) {
      const auto x0 = from.place(x);
      vertex.t0 = {x0[0], x0[1], x0[2], 0.0};
    }
    const auto x1 = to.place(x);
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

template <class Real>
Status check_positions(std::span<const Real> positions, std::uint32_t vertex_count, const std::string& what,
                       StopSignal stop) {
  const std::size_t expected = std::size_t{3} * vertex_count;
  if (positions.size() != expected) {
    return invalid_argument(what + ": " + std::to_string(positions.size()) + " values where " +
                            std::to_string(expected) + " are expected (3 for each of " +
                            std::to_string(vertex_count) + " vertices)");
  }
  // All at once first: a sum of zeros times values is zero, unless one is not finite.
  std::array<Real, 16> sums{};
  in_pieces(0, expected, stop, [&](std::size_t at, std::size_t end) {
    for (; at + sums.size() <= end; at += sums.size()) {
      for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += positions[at + k] * Real{0};
    }
    for (; at < end; ++at) sums[0] += positions[at] * Real{0};
  });
  if (std::ranges::all_of(sums, [](Real sum) { return sum == 0; })) return {};
  PacedStop paced(stop);
  for (std::size_t i = 0; i < expected; ++i) {
    paced.check();
    if (!std::isfinite(positions[i])) {
      return invalid_argument(what + "[" + std::to_string(i / 3) + "]." + "xyz"[i % 3] + ": is " +
                              (std::isnan(positions[i]) ? "not a number" : "infinite") +
                              "; coordinates must be finite");
    }
  }
  return {};
}

template void Motion::move_all<float>(std::uint32_t, std::uint32_t, From, std::span<const float>,
                                      std::span<const std::uint32_t>, std::uint32_t, RangeMotion&,
                                      StopSignal);
template void Motion::move_all<double>(std::uint32_t, std::uint32_t, From, std::span<const double>,
                                       std::span<const std::uint32_t>, std::uint32_t, RangeMotion&,
                                       StopSignal);
template Status check_positions<float>(std::span<const float>, std::uint32_t, const std::string&, StopSignal);
template Status check_positions<double>(std::span<const double>, std::uint32_t, const std::string&,
                                        StopSignal);

}  // namespace warmfront
