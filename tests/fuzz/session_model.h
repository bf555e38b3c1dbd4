// SPDX-License-Identifier: Apache-2.0
// A model of a session by its contract, which the real one is compared with: the frame expected, where
// everything is, the scene's bodies as they are, and the answer to each frame from a new collider that
// starts at the positions before. Used by one thread at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "engine/contact_hash.h"
#include "server/session/answer.h"
#include "tests/fuzz/expect.h"

namespace warmfront::fuzz {

inline constexpr std::uint32_t kCorners = 4;  ///< of each body, which is a square

/// The faces of one square.
inline std::vector<std::array<std::int32_t, 3>> square_faces(std::int32_t first = 0) {
  return {{first, first + 1, first + 2}, {first + 1, first + 3, first + 2}};
}

/// Two squares: small, so that a run does many. The second one may be anything.
inline SceneDescription tiny_scene(BodyKind second = BodyKind::kDeformable) {
  SceneDescription scene;
  scene.vertex_count = 2 * kCorners;
  scene.faces = square_faces();
  for (const auto& face : square_faces(kCorners)) scene.faces.push_back(face);
  scene.bodies = {{"", 0, kCorners}, {"", kCorners, kCorners, second}};
  return scene;
}

/// One square; `pose` moves it through the others.
inline std::vector<double> square_positions(std::uint32_t square, std::uint8_t pose) {
  const double height = (pose % 2 == 0 ? 0.5 : -0.5) + 0.01 * pose;
  std::vector<double> positions;
  for (int corner = 0; corner < static_cast<int>(kCorners); ++corner) {
    positions.push_back(corner % 2 + 0.3 * square);
    positions.push_back(corner / 2 + 0.2 * square);
    positions.push_back(square * height + 0.05 * corner * (pose % 3));
  }
  return positions;
}

inline std::vector<double> tiny_positions(std::uint8_t pose) {
  std::vector<double> positions = square_positions(0, pose);
  for (const double x : square_positions(1, pose)) positions.push_back(x);
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
  SessionModel(std::shared_ptr<Workers> workers, std::uint64_t first_frame, BodyKind second)
      : workers_(std::move(workers)),
        first_(first_frame),
        expected_(first_frame + 1),
        scene_(std::make_shared<const Scene>(Scene::create(tiny_scene(second)).value())),
        positions_(tiny_positions(0)),
        rest_(positions_),
        poses_(scene_->body_count()) {}

  std::uint64_t expected() const { return expected_; }
  bool stepped() const { return expected_ > first_ + 1; }
  const Scene& scene() const { return *scene_; }
  const std::vector<double>& positions() const { return positions_; }
  const std::vector<double>& rest() const { return rest_; }
  std::uint64_t last_hash() const { return last_hash_; }

  bool fixed(std::uint32_t body) const {
    const BodyKind kind = scene_->bodies()[body].kind;
    return kind == BodyKind::kStatic || kind == BodyKind::kRemoved;
  }
  /// All positions, with what may not move where it is.
  std::vector<double> positions_for(std::uint8_t pose) const {
    std::vector<double> all = positions_;
    for (std::uint32_t b = 0; b < scene_->body_count(); ++b)
      if (!fixed(b)) std::ranges::copy(square_positions(b, pose), numbers_of(all, b).begin());
    return all;
  }

  /// Takes the expected frame, which puts everything at `next`, giving the positions of the bodies marked in
  /// `given`, and these poses of others (the rest of them not at all); false, and nothing changes, when the
  /// engine refuses the positions.
  bool step(const std::vector<double>& next, const std::vector<bool>& given,
            const std::vector<BodyPose>& poses = {}) {
    Collider cold = at_rest();
    std::vector<BodyPositions> others;  // where poses say where some are
    for (std::uint32_t b = 0; b < scene_->body_count() && !poses.empty(); ++b) {
      if (fixed(b) || std::ranges::find(poses, b, &BodyPose::body) != poses.end()) continue;
      others.push_back({b, std::span<const double>(next).subspan(first_number(b), 3 * kCorners)});
    }
    Frame frame;
    frame.bodies = others;
    frame.poses = poses;
    if (poses.empty()) frame.positions = std::span<const double>(next);
    const auto result = cold.step(frame);
    if (!result) return false;
    ContactHash hash;
    hash.add_step(*scene_, result.value().contacts);
    last_hash_ = hash.value();
    positions_ = cold.positions();
    for (std::uint32_t b = 0; b < scene_->body_count(); ++b)
      if (given[b]) keep_rest(b);
    for (const auto& [b, pose] : poses) poses_[b] = pose;
    ++expected_;
    return true;
  }
  bool step(const std::vector<double>& next) {
    return step(next, std::vector<bool>(scene_->body_count(), true));
  }

  /// Adds a square; false, and nothing changes, when the engine refuses it.
  bool add(const BodyAddition& addition, const std::vector<double>& positions) {
    Result<Scene> scene = scene_->with_body(addition);
    if (!scene) return false;
    scene_ = std::make_shared<const Scene>(std::move(scene).value());
    positions_.insert(positions_.end(), positions.begin(), positions.end());
    rest_.insert(rest_.end(), positions.begin(), positions.end());
    poses_.emplace_back();
    return true;
  }
  bool change(std::uint32_t index, const Body& body) {
    const bool known = index < scene_->body_count();
    if (!known || scene_->bodies()[index].kind == BodyKind::kRemoved) return false;
    const bool was_rigid = scene_->bodies()[index].kind == BodyKind::kRigid;
    Result<Scene> scene = scene_->with_body_changed(index, body);
    if (!scene) return false;
    scene_ = std::make_shared<const Scene>(std::move(scene).value());
    if (!was_rigid || body.kind != BodyKind::kRigid) keep_rest(index);
    return true;
  }

 private:
  static std::size_t first_number(std::uint32_t body) { return std::size_t{3 * kCorners} * body; }
  static std::span<double> numbers_of(std::vector<double>& all, std::uint32_t body) {
    return std::span(all).subspan(first_number(body), 3 * kCorners);
  }
  /// Poses are of where it is now.
  void keep_rest(std::uint32_t body) {
    std::ranges::copy(numbers_of(positions_, body), numbers_of(rest_, body).begin());
    poses_[body].reset();
  }
  /// A new collider, everything where it is.
  Collider at_rest() {
    std::vector<double> start = positions_;
    std::vector<BodyPose> posed;
    for (std::uint32_t b = 0; b < scene_->body_count(); ++b) {
      if (!poses_[b]) continue;
      posed.push_back({b, *poses_[b]});
      std::ranges::copy(numbers_of(rest_, b), numbers_of(start, b).begin());
    }
    Collider cold =
        Collider::create(scene_, std::span<const double>(start), {.front = FrontMode::kNone}, workers_)
            .value();
    if (!posed.empty()) expect(cold.place(posed).ok(), "what is at a pose can be put there");
    return cold;
  }

  const std::shared_ptr<Workers> workers_;
  const std::uint64_t first_;
  std::uint64_t expected_;
  std::shared_ptr<const Scene> scene_;
  std::vector<double> positions_;
  std::vector<double> rest_;                // of each body, which a pose is of
  std::vector<std::optional<Pose>> poses_;  // by body: that it is at, of these
  std::uint64_t last_hash_ = 0;
};

}  // namespace warmfront::fuzz
