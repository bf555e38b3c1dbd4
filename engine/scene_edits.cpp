// SPDX-License-Identifier: Apache-2.0
// A scene with bodies added, changed and replaced.
#include <array>
#include <span>
#include <utility>
#include <variant>

#include "engine/scene.h"
#include "engine/scene/description_checks.h"
#include "engine/scene/replaced_bodies.h"
#include "engine/scene/scene_edit.h"

namespace warmfront {

Result<Scene> Scene::with_body(BodyAddition addition) const {
  std::array<SceneChange, 1> changes{AddBody{std::move(addition), {}}};
  std::size_t failed = 0;
  return with_changes(changes, failed);
}

Result<Scene> Scene::with_body_changed(std::uint32_t index, Body body) const {
  Scene scene = *this;
  if (Status status = scene.change(index, std::move(body)); !status) return status.error();
  return scene;
}

Result<Scene> Scene::with_changes(std::span<SceneChange> changes, std::size_t& failed, StopSignal stop,
                                  ReplacedBodies* replaced) const {
  SceneEdit edit(*this, stop);
  for (failed = 0; failed < changes.size(); ++failed) {
    stop.check();
    const auto carry_out = [&](auto& change) { return edit.carry_out(change, failed); };
    if (Status status = std::visit(carry_out, changes[failed]); !status) return status.error();
  }
  if (Status status = edit.check_bodies(); !status) {
    failed = changes.empty() ? 0 : changes.size() - 1;
    return status.error();
  }
  ReplacedBodies nowhere;
  return edit.finish(replaced != nullptr ? *replaced : nowhere);
}

Status Scene::change(std::uint32_t index, Body body) {
  if (Status status = check_body_number("index", index, bodies_.size()); !status) return status;
  body.first_vertex = bodies_[index].first_vertex;
  body.vertex_count = bodies_[index].vertex_count;
  const std::optional<HalfSpace>& half_space = bodies_[index].half_space;
  if (half_space && !body.half_space) {
    if (body.kind != BodyKind::kRemoved)
      return invalid_argument(name_of(index) +
                              ".half_space: is missing; the body is a half-space and stays one: give it");
    body.half_space = half_space;
  }
  if (Status status = check_body(body, name_of(index)); !status) return status.error();
  name_bytes_ += body.name.size() - bodies_[index].name.size();
  bodies_[index] = std::move(body);
  return {};
}

}  // namespace warmfront
