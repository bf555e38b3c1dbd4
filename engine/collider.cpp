// SPDX-License-Identifier: Apache-2.0
#include "engine/collider.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "engine/all_deformable.h"
#include "engine/auto_bounds.h"
#include "engine/pipeline.h"
#include "engine/scene/found_bodies.h"
#include "engine/stoppable_loops.h"

namespace warmfront {
namespace {

Status check(const Positions& positions, std::uint32_t vertex_count, StopSignal stop) {
  return std::visit([&](auto values) { return check_positions(values, vertex_count, "positions", stop); },
                    positions);
}

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

// The scene, with the bodies that are found where it declares none.
std::shared_ptr<const Scene> model_of(std::shared_ptr<const Scene> scene, const ColliderOptions& options,
                                      StopSignal stop) {
  if (!options.find_bodies || !scene->bodies().empty()) return scene;
  std::vector<Body> bodies = found_bodies(*scene, stop);
  if (bodies.empty()) return scene;
  return std::make_shared<const Scene>(scene->with_bodies(std::move(bodies), stop).value());
}

}  // namespace

struct Collider::Impl {
  Core core;
  std::unique_ptr<Pipeline> pipeline;
  std::unique_ptr<AllDeformable> all_deformable = nullptr;  // with options.explain

  // See Collider::change(). Throws Stopped; `at` is the change that an error is of.
  Status change(std::span<SceneChange> changes, StopSignal stop, std::size_t& at);

  // The scene is another one from now on.
  void take(std::shared_ptr<const Scene> scene, Core::Parts parts) noexcept {
    core.scene = std::move(scene);
    core.take(std::move(parts));
    pipeline->parts_changed();
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
  if (Status status = validate(options); !status) return status.error();
  const StopSignal stop(cancelled);
  if (Status status = check_hubs(*scene, stop); !status) return status.error();
  if (Status status = check(positions, scene->vertex_count(), stop); !status) return status.error();
  const std::shared_ptr<const Scene> modelled = model_of(scene, options, stop);
  Core core(std::move(scene), *modelled, positions, options, std::move(workers), stop);
  std::unique_ptr<Pipeline> pipeline =
      options.bounds == BoundsKind::kAuto ? make_auto_pipeline() : make_pipeline(options.bounds);
  Collider collider(std::make_unique<Impl>(Impl{std::move(core), std::move(pipeline)}));
  if (options.explain)
    collider.impl_->all_deformable = std::make_unique<AllDeformable>(collider.impl_->core.workers);
  return collider;
} catch (const Stopped&) {
  return was_cancelled();
}

Result<StepResult> Collider::step(const Frame& frame, const std::atomic<bool>* cancelled,
                                  const AcceptStep& accept) try {
  Core& core = impl_->core;
  if (Status status = core.motion.check(*core.scene, frame, StopSignal(cancelled)); !status)
    return status.error();
  if (impl_->all_deformable != nullptr) impl_->all_deformable->begin(*this, cancelled);
  Result<StepResult> result = impl_->pipeline->step(core, frame, StopSignal(cancelled), accept);
  if (result && impl_->all_deformable != nullptr)
    result.value().all_deformable = impl_->all_deformable->follow(*this, cancelled);
  return result;
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::place(std::span<const BodyPose> poses, const std::atomic<bool>* cancelled) try {
  Core& core = impl_->core;
  Frame frame;
  frame.poses = poses;
  if (Status status = core.motion.check(*core.scene, frame, StopSignal(cancelled)); !status) return status;
  if (Status status = core.motion.set_poses(poses); !status) return status;
  impl_->compare_anew();
  return {};
} catch (const Stopped&) {
  return was_cancelled();
}

Result<std::uint32_t> Collider::add_body(BodyAddition addition, const Positions& positions,
                                         const std::atomic<bool>* cancelled) try {
  std::vector<SceneChange> changes;
  changes.emplace_back(AddBody{std::move(addition), to_doubles(positions, StopSignal(cancelled))});
  if (Status status = change(std::move(changes), cancelled); !status) return status.error();
  return impl_->core.scene->body_count() - 1;
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::change_body(std::uint32_t index, Body body, const std::atomic<bool>* cancelled) {
  std::vector<SceneChange> changes;
  changes.emplace_back(ChangeBody{index, std::move(body)});
  return change(std::move(changes), cancelled);
}

namespace {

// What becomes of a body that was there before some changes.
struct Redescribed {
  std::uint32_t index;
  BodyKind kind;             // by the changes looked at
  bool became_rigid = false;  // once at least
  std::shared_ptr<const ReferenceShape> shape = nullptr;  // where it is rigid by that
  double reach = 0;
};

// By index.
std::vector<Redescribed> redescribed(const Scene& scene, std::span<const SceneChange> changes) {
  std::vector<std::pair<std::uint32_t, BodyKind>> kinds;
  for (const SceneChange& change : changes) {
    const auto* changed = std::get_if<ChangeBody>(&change);
    if (changed != nullptr && changed->index < scene.bodies().size())
      kinds.emplace_back(changed->index, changed->body.kind);
  }
  std::ranges::stable_sort(kinds, {}, [](const auto& kind) { return kind.first; });
  std::vector<Redescribed> all;
  for (const auto& [index, kind] : kinds) {
    if (all.empty() || all.back().index != index) all.push_back({index, scene.bodies()[index].kind});
    all.back().became_rigid |= kind == BodyKind::kRigid && all.back().kind != BodyKind::kRigid;
    all.back().kind = kind;
  }
  return all;
}

// The change to blame for a body that is too much: the last that says anything of it, or else the last.
std::size_t blamed(std::uint32_t body, std::uint32_t bodies_before, std::span<const SceneChange> changes) {
  std::size_t blamed = changes.size() - 1;
  std::uint32_t added = bodies_before;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const auto* changed = std::get_if<ChangeBody>(&changes[i]);
    if ((changed != nullptr ? changed->index : added++) == body) blamed = i;
  }
  return blamed;
}

}  // namespace

Status Collider::change(std::vector<SceneChange> changes, const std::atomic<bool>* cancelled,
                        std::size_t* failed) try {
  std::size_t at = 0;
  Status status = impl_->change(changes, StopSignal(cancelled), at);
  if (!status && failed != nullptr) *failed = at;
  return status;
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::Impl::change(std::span<SceneChange> changes, StopSignal stop, std::size_t& at) {
  const std::uint32_t bodies_before = core.scene->body_count();
  const std::uint32_t first_vertex = core.scene->vertex_count();
  std::vector<Redescribed> others = redescribed(*core.scene, changes);
  Result<Scene> changed = core.scene->with_changes(changes, at, stop);
  if (!changed) return changed.error();
  auto scene = std::make_shared<const Scene>(std::move(changed).value());

  std::vector<double> positions;
  positions.reserve(3 * std::size_t{scene->vertex_count() - first_vertex});
  std::uint32_t added = bodies_before;
  for (at = 0; at < changes.size(); ++at) {
    const auto* add = std::get_if<AddBody>(&changes[at]);
    if (add == nullptr) continue;
    const std::span<const double> values = add->positions;
    if (Status status = check(values, scene->bodies()[added++].vertex_count, stop); !status) return status;
    append(positions, values, stop);
  }

  const bool extended = added > bodies_before;
  bool tests_more = extended;
  bool names_alone = !extended;
  std::erase_if(others, [&](Redescribed& other) {
    const Body& from = core.scene->bodies()[other.index];
    const Body& to = scene->bodies()[other.index];
    other.became_rigid &= to.kind == BodyKind::kRigid;
    tests_more |= tests_itself(to) && !tests_itself(from);
    if (!is_modelled_alike(from, to) || other.became_rigid) {
      names_alone = false;
      return false;
    }
    return true;
  });
  if (names_alone) {
    core.scene = std::move(scene);
    return {};
  }
  std::uint32_t hub = 0;
  if (tests_more) {
    if (Status status = check_hubs(*scene, stop, &hub); !status) {
      at = blamed(scene->body_of_vertex()[hub], bodies_before, changes);
      return status;
    }
  }

  std::optional<Growth> growth;
  std::optional<Core::Parts> parts;
  if (extended) growth.emplace(core);
  core.workers->run([&] {
    for (Redescribed& other : others) {
      core.motion.settle(other.index, stop);
      if (other.became_rigid) other.shape = core.motion.shape_of(other.index, stop);
      else if (other.kind != core.scene->bodies()[other.index].kind)
        other.reach = core.motion.measured_reach(other.index, stop);
    }
    if (extended) {
      core.motion.append(*scene, positions, stop);
      core.topology->extend(*scene, core.motion.vertices(), stop);
      core.motion.renumber(core.topology->numbering, first_vertex, stop);
    }
    parts = core.make_parts(*scene, *scene, extended, stop);
  });
  if (growth) growth->keep();
  for (Redescribed& other : others)
    core.motion.change_kind(other.index, other.kind, std::move(other.shape), other.reach);
  take(std::move(scene), std::move(*parts));
  return {};
}

Status Collider::self_check(const std::atomic<bool>* cancelled) try {
  return impl_->pipeline->self_check(impl_->core, StopSignal(cancelled));
} catch (const Stopped&) {
  return was_cancelled();
}
void Collider::forget_warmth() {
  impl_->pipeline->forget(impl_->core);
}

const Scene& Collider::scene() const {
  return *impl_->core.scene;
}
std::shared_ptr<const Scene> Collider::shared_scene() const {
  return impl_->core.scene;
}
const ColliderOptions& Collider::options() const {
  return impl_->core.options;
}
std::vector<double> Collider::positions() const {
  return impl_->core.motion.positions();
}

std::size_t Collider::memory_bytes() const {
  const Core& core = impl_->core;
  std::size_t bytes = core.scene->memory_bytes() + core.topology->memory_bytes() +
                      core.motion.memory_bytes() + core.vertex_bounds.capacity() * sizeof(PointBounds) +
                      core.contacts.capacity() * sizeof(Contact) +
                      core.geometry.capacity() * sizeof(ContactGeometry) + core.rigid_parts.memory_bytes() +
                      impl_->pipeline->memory_bytes();
  for (const auto& orphans : core.orphans) {
    if (orphans != nullptr) bytes += orphans->memory_bytes();
  }
  if (impl_->all_deformable != nullptr) bytes += impl_->all_deformable->memory_bytes();
  return bytes;
}

}  // namespace warmfront
