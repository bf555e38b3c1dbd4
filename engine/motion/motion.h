// SPDX-License-Identifier: Apache-2.0
// Vertex positions at t = 0 and t = 1 of the current step, which of them move, and the power-of-two frame
// that bounds are computed in. Written between steps by one thread, read by all during a step.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/parallel/move_runs.h"
#include "engine/pose.h"
#include "engine/result.h"
#include "engine/scene/numbers.h"
#include "engine/stop.h"

namespace warmfront {

/// One vertex's motion in a cache line: position at t = 0 and at t = 1 (the fourth lanes are zero).
struct alignas(64) VertexMotion {
  std::array<double, 4> t0;
  std::array<double, 4> t1;
};

/// What became of a vertex, or of anything bounded by some: bits.
using MotionState = std::uint8_t;
inline constexpr MotionState kMoving = 1;   ///< t0 and t1 differ in this step
inline constexpr MotionState kChanged = 2;  ///< its motion is another than in the step before; kMoving too

/// Bounds are float32, so they are computed in a local frame, (x - origin) * scale, in which the scene as
/// first given has its middle at 0 and a size near 1, whatever its offset and scale. `scale` is a power of
/// two, held in two factors whose product may leave double's range. The frame is a matter of tightness only:
/// no answer depends on it.
struct LocalTransform {
  std::array<double, 3> origin{};
  double scale_a = 1;
  double scale_b = 1;

  double to_local(double length) const { return length * scale_a * scale_b; }
  double to_scene(double length) const { return length / scale_b / scale_a; }
};

/// Where a question's motion begins.
enum class From : std::uint8_t {
  kEnd,    ///< where the motion before ended: that was taken
  kStart,  ///< where it began: that was only asked about
};

/// The motion of a range of vertices within a step, in sum.
struct RangeMotion {
  MotionState any = 0;  ///< union over the vertices
  MotionState all = 0;  ///< intersection
  /// The vertices whose state is not 0, when they are few and were named one by one; else they are looked up.
  std::vector<std::uint32_t> changed;
  bool listed = true;
  /// No local coordinate at t = 1 is larger in magnitude; infinite beyond double's range.
  double reach = 0;
  /// The reach may be too large by a factor of 2 or more: see Motion::measure().
  bool loose = false;
  /// By grain of the range: this step has reached its vertices. What a step that fails leaves undone is told
  /// from what it did by these alone. Of a range of one grain, as most bodies are, no memory of its own.
  std::uint8_t only_grain_begun = 0;
  std::vector<std::uint8_t> begun;
};

class Motion {
 public:
  /// `positions` row-major (n, 3), finite: stationary. Throws Stopped when told to stop, as all that takes a
  /// StopSignal.
  explicit Motion(std::span<const double> positions, StopSignal stop = {});

  /// Vertex i becomes what was vertex order[i], from `first` on. After an exception nothing has changed.
  void renumber(std::span<const GivenVertex> order, std::size_t first = 0, StopSignal stop = {});
  /// Appends stationary vertices; truncate() takes them back, also after an exception.
  void append(std::span<const double> positions, StopSignal stop = {});
  void truncate(std::size_t vertex_count);
  /// One of the same frame and magnitude whose vertices are stationary at these positions.
  Motion of_positions(std::span<const double> positions, StopSignal stop) const;
  /// Vertices move to where the runs say, among `vertex_count`, for which make_room() made room; take() then
  /// puts those of another one, of that frame, to `first`. Throws Stopped, nothing has changed then, when
  /// told to stop.
  void make_room(std::size_t vertex_count, StopSignal stop);
  void splice(std::span<const Run> runs, std::size_t vertex_count) noexcept;
  void take(const Motion& other, std::size_t first) noexcept;

  /// A step of vertices [first, end): row order[v] - first_row of `positions` is where vertex v goes. What
  /// keeps its position, bit for bit, does not move. Parallel inside Workers::run(). After an exception,
  /// undo().
  template <class Real>
  void move_all(std::uint32_t first, std::uint32_t end, From from, std::span<const Real> positions,
                std::span<const GivenVertex> order, std::uint32_t first_row, RangeMotion& range,
                StopSignal stop = {});
  /// The same, where only what is named moves: begins the step of a range (an exception leaves every position
  /// as it was: there is nothing to undo), ...
  void rest(std::uint32_t first, std::uint32_t end, From from, RangeMotion& range, StopSignal stop = {});
  /// ... and moves one of its vertices; nothing has changed after an exception.
  void move_one(std::uint32_t vertex, const std::array<double, 3>& to, RangeMotion& range);
  /// A step of vertices [first, end) from one pose of their reference positions, (end - first, 3), to
  /// another, whatever they did before; `at_from` says at which end of their last motion they are at `from`,
  /// if at any. Sets no reach. Parallel inside Workers::run(). After an exception, undo().
  void move_posed(std::uint32_t first, std::uint32_t end, std::span<const double> reference, const Pose& from,
                  const Pose& to, std::optional<From> at_from, RangeMotion& range, StopSignal stop = {});
  /// Takes back the step of a range that was moved, wholly or, by an exception, in part; the next step finds
  /// its vertices changed. From::kStart: also of vertices that the step had not reached, which are where the
  /// question before put them.
  void undo(std::uint32_t first, std::uint32_t end, From from, RangeMotion& range) noexcept;
  /// A range that is stationary counts as changed in the next step.
  void mark_changed(std::uint32_t first, std::uint32_t end, RangeMotion& range) noexcept;
  /// Ends the motion of a range, which was moved, at `fraction` of its way: see Collider::commit().
  void shorten(std::uint32_t first, std::uint32_t end, double fraction, bool single,
               RangeMotion& range) noexcept;
  /// Measures the range's reach at t = 1. O(end - first). Where it is stopped nothing has changed.
  void measure(std::uint32_t first, std::uint32_t end, RangeMotion& range, StopSignal stop = {}) const;

  std::span<const VertexMotion> vertices() const { return vertices_; }
  std::span<const MotionState> states() const { return states_; }
  const LocalTransform& frame() const { return frame_; }

  /// At least every local coordinate of the step: a power of two, so that bounds made with it serve for many
  /// steps. Infinite beyond double's range.
  double magnitude() const { return magnitude_; }
  /// Makes the magnitude hold this reach: grows at once, shrinks where it is 8 times too large or more, so
  /// that an outlier costs only as long as it is there and no oscillation remakes all bounds in every step.
  void follow(double reach);
  /// As it was before.
  void restore_magnitude(double magnitude) { magnitude_ = magnitude; }

  /// The largest local coordinate of a point, in magnitude; infinite where it is not a number.
  double reach_of(const std::array<double, 3>& x) const;

  std::size_t memory_bytes() const {
    return vertices_.capacity() * sizeof(VertexMotion) + states_.capacity() * sizeof(MotionState);
  }

 private:
  void stop_range(std::uint32_t first, std::uint32_t end, From from, RangeMotion& range, StopSignal stop);

  std::vector<VertexMotion> vertices_;
  std::vector<MotionState> states_;
  LocalTransform frame_;
  double magnitude_ = 0;
};

}  // namespace warmfront
