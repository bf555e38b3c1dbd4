// SPDX-License-Identifier: Apache-2.0
#include "engine/collider.h"

#include <memory>
#include <optional>
#include <utility>

#include "engine/step/all_deformable.h"
#include "engine/step/warm_scene.h"

namespace warmfront {
namespace {

bool tests_itself(const Body& body) {
  return body.kind == BodyKind::kDeformable && body.self_collision;
}

// Do two descriptions of a body differ in its name alone?
bool is_modelled_alike(const Body& a, Body b) {
  b.name = a.name;
  return a == b;
}

Error was_cancelled() {
  return {ErrorCode::kCancelled, "the call was cancelled; it may be made again"};
}

}  // namespace

struct Collider::Impl {
  WarmScene warm;
  std::unique_ptr<AllDeformable> all_deformable = nullptr;  // with options.explain

  // The scene is another one from now on.
  void take(std::shared_ptr<const Scene> scene, Core::Parts parts) noexcept {
    warm.core.scene = std::move(scene);
    warm.core.take(std::move(parts));
    warm.pipeline->parts_changed();
    compare_anew();
  }

  void compare_anew() {
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
                                  const AcceptStep& accept) {
  Core& core = impl_->warm.core;
  const StopSignal stop(cancelled);
  if (Status status = core.motion.check(*core.scene, frame); !status) return status.error();
  if (impl_->all_deformable != nullptr) impl_->all_deformable->begin(core, stop);
  Result<StepResult> result = impl_->warm.step(frame, stop, accept);
  if (result && impl_->all_deformable != nullptr)
    result.value().all_deformable = impl_->all_deformable->follow(core, stop);
  return result;
}

Status Collider::place(std::span<const BodyPose> poses) {
  Core& core = impl_->warm.core;
  Frame frame;
  frame.poses = poses;
  if (Status status = core.motion.check(*core.scene, frame); !status) return status;
  if (Status status = core.motion.set_poses(poses); !status) return status;
  impl_->compare_anew();
  return {};
}

Result<std::uint32_t> Collider::add_body(BodyAddition addition, const Positions& positions,
                                         const std::atomic<bool>* cancelled) try {
  Core& core = impl_->warm.core;
  const StopSignal stop(cancelled);
  Result<Scene> extended = core.scene->with_body(std::move(addition));
  if (!extended) return extended.error();
  if (Status status = check_hubs(extended.value()); !status) return status.error();
  if (Status status = check_positions(positions, extended.value().bodies().back().vertex_count); !status)
    return status.error();
  const std::uint32_t first = core.scene->vertex_count();
  auto scene = std::make_shared<const Scene>(std::move(extended).value());
  const std::vector<double> values = to_doubles(positions);
  Growth growth(core);
  std::optional<Core::Parts> parts;
  core.motion.append(*scene, values);
  core.workers->run([&] {
    core.topology->extend(*scene, core.motion.vertices(), stop);
    core.motion.renumber(core.topology->numbering, first);
    parts = core.make_parts(*scene, *scene, true, stop);
  });
  growth.keep();
  impl_->take(std::move(scene), std::move(*parts));
  return core.scene->body_count() - 1;
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::change_body(std::uint32_t index, Body body, const std::atomic<bool>* cancelled) try {
  Core& core = impl_->warm.core;
  const StopSignal stop(cancelled);
  if (index < core.scene->bodies().size() && core.scene->bodies()[index].kind == BodyKind::kRemoved)
    return invalid_argument("body " + std::to_string(index) + " was removed; add a new one");
  Result<Scene> changed = core.scene->with_body_changed(index, std::move(body));
  if (!changed) return changed.error();
  const Body& from = core.scene->bodies()[index];
  const Body& to = changed.value().bodies()[index];
  if (from == to) return {};
  auto scene = std::make_shared<const Scene>(std::move(changed).value());
  if (is_modelled_alike(from, to)) {
    core.scene = std::move(scene);
    return {};
  }
  if (tests_itself(to) && !tests_itself(from))
    if (Status status = check_hubs(*scene); !status) return status.error();
  std::shared_ptr<const ReferenceShape> shape;
  std::optional<Core::Parts> parts;
  core.workers->run([&] {
    core.motion.settle(index);
    if (from.kind != to.kind && to.kind == BodyKind::kRigid) shape = core.motion.shape_of(index);
    parts = core.make_parts(*scene, *scene, false, stop);
  });
  core.motion.change_kind(index, to.kind, std::move(shape));
  impl_->take(std::move(scene), std::move(*parts));
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
