// SPDX-License-Identifier: Apache-2.0
// One mesh's collider, kept warm over whatever motions and states are asked about, in any order. Of IPC
// Toolkit it knows nothing. Used by one thread at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "client/ipc_toolkit/near_by_axes.h"
#include "engine/collider.h"

namespace warmfront::ipc_toolkit {

/// The error as an exception: std::invalid_argument for what the caller gave, else std::runtime_error.
[[noreturn]] inline void throw_error(const Error& error) {
  if (error.code == ErrorCode::kInvalidArgument) throw std::invalid_argument("warmfront: " + error.message);
  throw std::runtime_error("warmfront: " + error.message);
}

template <class T>
T value_or_throw(Result<T> result) {
  if (!result) throw_error(result.error());
  return std::move(result).value();
}

/// Candidates of motions and of states. A collider's base is where motions begin; which one this has is
/// chosen so that little is done anew: the last motion's end becomes the base where the next one begins
/// there, and a state is reached from what is nearer to it, the base or that end.
class WarmCollider {
 public:
  WarmCollider(std::shared_ptr<const Scene> scene, std::shared_ptr<Workers> workers)
      : scene_(std::move(scene)), workers_(std::move(workers)) {}

  /// Every pair that comes within `separation` on the linear motion, and others whose moving 18-DOPs do: rows
  /// sorted as contacts are, valid until the next question. Positions are (n, 3).
  std::span<const Contact> near_on_motion(std::span<const double> start, std::span<const double> end,
                                          double separation) {
    stand_at(start);
    return candidates_to(end, separation);
  }

  /// Every pair that is within `separation` at the state, and others whose 18-DOPs are: likewise. Which these
  /// are does not depend on what was asked before.
  std::span<const Contact> near_at(std::span<const double> state, double separation) {
    stand_near(state);
    const std::span<const Contact> on_the_way = candidates_to(state, separation);
    near_.clear();
    std::ranges::copy_if(on_the_way, std::back_inserter(near_),
                         [&](const Contact& pair) { return near_there(pair, state, separation); });
    return near_;
  }

  /// Edges and faces that meet where the last question's motion began, or at its end (the state). Valid until
  /// the next question.
  std::span<const Contact> intersections(Where where) {
    return value_or_throw(collider_->intersections(where, {.max_contacts = kUnbounded})).contacts;
  }

  const Scene& scene() const { return *scene_; }

 private:
  static constexpr std::size_t kUnbounded = std::numeric_limits<std::size_t>::max();

  static bool same(std::span<const double> a, std::span<const double> b) { return std::ranges::equal(a, b); }

  // The square of the longest way of a vertex.
  static double farthest(std::span<const double> from, std::span<const double> to) {
    double most = 0;
    for (std::size_t i = 0; i + 2 < from.size(); i += 3) {
      const double x = to[i] - from[i];
      const double y = to[i + 1] - from[i + 1];
      const double z = to[i + 2] - from[i + 2];
      most = std::max(most, x * x + y * y + z * z);
    }
    return most;
  }

  static double extent(std::span<const double> positions) {
    double widest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double lo = std::numeric_limits<double>::infinity();
      double hi = -lo;
      for (std::size_t i = axis; i < positions.size(); i += 3) {
        lo = std::min(lo, positions[i]);
        hi = std::max(hi, positions[i]);
      }
      widest = std::max(widest, hi - lo);
    }
    return widest;
  }

  void create_at(std::span<const double> state) {
    collider_.emplace(value_or_throw(Collider::create(scene_, state, {}, workers_)));
    base_.assign(state.begin(), state.end());
    end_.clear();
  }

  void take_last_motion() {
    value_or_throw(collider_->commit(1));
    base_.swap(end_);
    end_.clear();
  }

  void stand_at(std::span<const double> state) {
    if (!collider_) return create_at(state);
    if (same(base_, state)) return;
    if (!end_.empty() && same(end_, state)) return take_last_motion();
    if (const Status placed = collider_->place(state); !placed) throw_error(placed.error());
    base_.assign(state.begin(), state.end());
    end_.clear();
  }

  // A motion to a state costs as far as it leads: beyond a 16th of the mesh's extent, standing there from the
  // start costs less (cloths of 10,000 to 92,000 triangles: from a 20th to a 10th on).
  void stand_near(std::span<const double> state) {
    if (!collider_) return create_at(state);
    if (!end_.empty() && farthest(end_, state) < farthest(base_, state)) take_last_motion();
    const double far = extent(base_) / 16;
    if (farthest(base_, state) > far * far) stand_at(state);
  }

  std::span<const Contact> candidates_to(std::span<const double> end, double separation) {
    end_.clear();  // also where the question fails
    const StepResult answer = value_or_throw(collider_->trial(
        end, {.min_separation = separation, .report = Report::kCandidates, .max_contacts = kUnbounded}));
    end_.assign(end.begin(), end.end());
    return answer.contacts;
  }

  bool near_there(const Contact& pair, std::span<const double> state, double separation) const {
    const std::array<std::uint32_t, 4> vertices = scene_->vertices_of(pair);
    FourPoints points;
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        points[k][axis] = state[3 * std::size_t{vertices[k]} + axis];
    return near_by_axes(points, vertices_of_first(pair.kind), separation);
  }

  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<Workers> workers_;
  std::optional<Collider> collider_;
  std::vector<double> base_;
  std::vector<double> end_;  // of the last trial; empty where there is none to be committed
  std::vector<Contact> near_;
};

}  // namespace warmfront::ipc_toolkit
