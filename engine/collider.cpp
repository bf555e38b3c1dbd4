// SPDX-License-Identifier: Apache-2.0
#include "engine/collider.h"

#include <memory>
#include <utility>

#include "engine/step/all_deformable.h"
#include "engine/step/scene_changes.h"
#include "engine/step/warm_scene.h"

namespace warmfront {
namespace {

Error was_cancelled() {
  return {ErrorCode::kCancelled, "the call was cancelled; it may be made again"};
}

}  // namespace

struct Collider::Impl {
  WarmScene warm;
  std::unique_ptr<AllDeformable> all_deformable = nullptr;  // with options.explain

  // The core has moved or become another one.
  void restart_comparison() {
    if (all_deformable != nullptr) all_deformable->forget();
  }
};

Collider::Collider(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Collider::~Collider() = default;
Collider::Collider(Collider&&) noexcept = default;
Collider& Collider::operator=(Collider&&) noexcept = default;

Result<Collider> Collider::create(std::shared_ptr<const Scene> scene, const Positions& positions,
                                  const ColliderOptions& options, std::shared_ptr<Workers> workers,
                                  const std::atomic<bool>* cancelled) try {
  Result<WarmScene> made =
      WarmScene::create(std::move(scene), positions, options, std::move(workers), StopSignal(cancelled));
  if (!made) return made.error();
  Collider collider(std::make_unique<Impl>(Impl{std::move(made).value()}));
  if (options.explain)
    collider.impl_->all_deformable = std::make_unique<AllDeformable>(collider.impl_->warm.core.workers);
  return collider;
} catch (const Stopped&) {
  return was_cancelled();
}

Result<StepResult> Collider::step(const Frame& frame, const std::atomic<bool>* cancelled,
                                  const AcceptStep& accept) try {
  Core& core = impl_->warm.core;
  const StopSignal stop(cancelled);
  if (Status status = core.motion.check(*core.scene, frame, stop); !status) return status.error();
  if (impl_->all_deformable != nullptr) impl_->all_deformable->begin(core, stop);
  Result<StepResult> result = impl_->warm.step(frame, stop, accept);
  if (result && impl_->all_deformable != nullptr)
    result.value().all_deformable = impl_->all_deformable->follow(core, stop);
  return result;
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::place(std::span<const BodyPose> poses, const std::atomic<bool>* cancelled) try {
  Core& core = impl_->warm.core;
  Frame frame;
  frame.poses = poses;
  if (Status status = core.motion.check(*core.scene, frame, StopSignal(cancelled)); !status) return status;
  if (Status status = core.motion.set_poses(poses); !status) return status;
  impl_->restart_comparison();
  return {};
} catch (const Stopped&) {
  return was_cancelled();
}

Result<std::uint32_t> Collider::add_body(BodyAddition addition, const Positions& positions,
                                         const std::atomic<bool>* cancelled) try {
  std::vector<SceneChange> changes;
  changes.emplace_back(AddBody{std::move(addition), to_doubles(positions, StopSignal(cancelled))});
  if (Status status = change(std::move(changes), cancelled); !status) return status.error();
  return impl_->warm.core.scene->body_count() - 1;
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::change_body(std::uint32_t index, Body body, const std::atomic<bool>* cancelled) {
  std::vector<SceneChange> changes;
  changes.emplace_back(ChangeBody{index, std::move(body)});
  return change(std::move(changes), cancelled);
}

Status Collider::change(std::vector<SceneChange> changes, const std::atomic<bool>* cancelled,
                        std::size_t* failed) try {
  std::size_t at = 0;
  Status status = change_scene(impl_->warm, changes, StopSignal(cancelled), at);
  if (!status) {
    if (failed != nullptr) *failed = at;
    return status;
  }
  impl_->restart_comparison();
  return {};
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::self_check(const std::atomic<bool>* cancelled) try {
  return impl_->warm.pipeline->self_check(impl_->warm.core, StopSignal(cancelled));
} catch (const Stopped&) {
  return was_cancelled();
}
void Collider::forget_warmth() {
  impl_->warm.pipeline->forget(impl_->warm.core);
}

const Scene& Collider::scene() const {
  return *impl_->warm.core.scene;
}
std::shared_ptr<const Scene> Collider::shared_scene() const {
  return impl_->warm.core.scene;
}
const ColliderOptions& Collider::options() const {
  return impl_->warm.core.options;
}
std::vector<double> Collider::positions() const {
  return impl_->warm.core.motion.positions();
}

std::size_t Collider::memory_bytes() const {
  std::size_t bytes = impl_->warm.memory_bytes();
  if (impl_->all_deformable != nullptr) bytes += impl_->all_deformable->memory_bytes();
  return bytes;
}

}  // namespace warmfront
