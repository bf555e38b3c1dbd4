// SPDX-License-Identifier: Apache-2.0
// A session as its contract has it, to hold the real one against: the frame expected, the answer to each
// frame from a collider that keeps no front, who is attached, and whether it was closed. Used by one thread
// at a time.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "engine/collider.h"
#include "engine/contact_hash.h"
#include "server/session/answer.h"
#include "tests/fuzz/expect.h"

namespace warmfront::fuzz {

/// Two triangles and a point's worth of space around: small, so that a run does many.
inline SceneDescription tiny_scene() {
  SceneDescription scene;
  scene.vertex_count = 8;
  scene.faces = {{0, 1, 2}, {1, 3, 2}, {4, 5, 6}, {5, 7, 6}};
  return scene;
}

/// Two squares; `pose` moves the second one through the first.
inline std::vector<double> tiny_positions(std::uint8_t pose) {
  std::vector<double> positions;
  const double height = (pose % 2 == 0 ? 0.5 : -0.5) + 0.01 * pose;
  for (int square = 0; square < 2; ++square)
    for (int corner = 0; corner < 4; ++corner) {
      positions.push_back(corner % 2 + 0.3 * square);
      positions.push_back(corner / 2 + 0.2 * square);
      positions.push_back(square * height + 0.05 * corner * (pose % 3));
    }
  return positions;
}

inline std::uint64_t hash_of(const server::Answer& answer) {
  ContactHash hash;
  hash.begin_step(answer.rows());
  for (std::size_t i = 0; i < answer.rows(); ++i)
    hash.add(static_cast<ContactKind>(answer.kind[i]), static_cast<ContactStatus>(answer.status[i]),
             answer.vertices[i], answer.toi[i]);
  return hash.value();
}

class SessionModel {
 public:
  SessionModel(std::shared_ptr<Workers> workers, std::uint64_t first_frame)
      : first_(first_frame),
        expected_(first_frame + 1),
        scene_(std::make_shared<const Scene>(Scene::create(tiny_scene()).value())) {
    ColliderOptions options;
    options.front = FrontMode::kNone;
    const std::vector<double> start = tiny_positions(0);
    collider_.emplace(
        Collider::create(scene_, std::span<const double>(start), options, std::move(workers)).value());
    last_positions_ = start;
  }

  std::uint64_t expected() const { return expected_; }
  bool stepped() const { return expected_ > first_ + 1; }
  const std::vector<double>& last_positions() const { return last_positions_; }
  std::uint64_t last_hash() const { return last_hash_; }

  /// Takes the expected frame; false, and nothing changes, when the engine refuses the positions.
  bool step(const std::vector<double>& positions) {
    const auto result = collider_->step(std::span<const double>(positions));
    if (!result) return false;
    ContactHash hash;
    hash.add_step(*scene_, result.value().contacts);
    last_hash_ = hash.value();
    last_positions_ = positions;
    ++expected_;
    return true;
  }

 private:
  const std::uint64_t first_;
  std::uint64_t expected_;
  std::shared_ptr<const Scene> scene_;
  std::optional<Collider> collider_;
  std::vector<double> last_positions_;
  std::uint64_t last_hash_ = 0;
};

}  // namespace warmfront::fuzz
