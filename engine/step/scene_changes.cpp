// SPDX-License-Identifier: Apache-2.0
#include "engine/step/scene_changes.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "engine/motion/check_positions.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/replaced_bodies.h"
#include "engine/scene/screws.h"
#include "engine/state/core_replacement.h"

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

// What becomes of a body that was there before some changes.
struct Redescribed {
  std::uint32_t index;
  BodyKind kind;                                          // by the changes looked at
  bool became_rigid = false;                              // once at least
  std::shared_ptr<const ReferenceShape> shape = nullptr;  // where it is rigid by that
  double reach = 0;
};

// By index; without those that are replaced, whose last description alone counts.
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
  for (const SceneChange& change : changes) {
    const auto* replaced = std::get_if<ReplaceBody>(&change);
    if (replaced != nullptr)
      std::erase_if(all, [&](const Redescribed& other) { return other.index == replaced->index; });
  }
  return all;
}

// The body that a change is of; `added`: the next index, which an addition takes.
std::optional<std::uint32_t> body_of(const SceneChange& change, std::uint32_t& added) {
  if (std::holds_alternative<AddBody>(change)) return added++;
  if (const auto* changed = std::get_if<ChangeBody>(&change)) return changed->index;
  if (const auto* elements = std::get_if<ReplaceElements>(&change)) return elements->index;
  if (const auto* replaced = std::get_if<ReplaceBody>(&change)) return replaced->index;
  return std::nullopt;
}

// The change to blame for a body that is too much: the last that says anything of it, or else the last.
std::size_t blamed(std::uint32_t body, std::uint32_t bodies_before, std::span<const SceneChange> changes) {
  std::size_t blamed = changes.size() - 1;
  std::uint32_t added = bodies_before;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (body_of(changes[i], added) == body) blamed = i;
  }
  return blamed;
}

bool is_of_filters(const SceneChange& change) {
  return std::holds_alternative<ChangeFilters>(change);
}
std::size_t last_of_filters(std::span<const SceneChange> changes) {
  std::size_t at = changes.size() - 1;
  while (!is_of_filters(changes[at])) --at;
  return at;
}

// Of changes that bring a body; null for others. The count is there after with_changes(), too, which moves
// out only what is allocated.
struct BroughtBody {
  std::uint32_t vertex_count;
  std::span<const double> positions;
};
std::optional<BroughtBody> brought_by(const SceneChange& change) {
  if (const auto* add = std::get_if<AddBody>(&change))
    return BroughtBody{add->addition.body.vertex_count, add->positions};
  if (const auto* replace = std::get_if<ReplaceBody>(&change))
    return BroughtBody{replace->addition.body.vertex_count, replace->positions};
  return std::nullopt;
}

// A scene without declared bodies is another one, with its vertices where they are.
Status replace_whole_scene(WarmScene& warm, std::shared_ptr<const Scene> scene, StopSignal stop) {
  const std::vector<double> positions = warm.core.motion.positions();
  Result<WarmScene> made = WarmScene::create(std::move(scene), std::span<const double>(positions),
                                             warm.core.options, warm.core.workers, stop);
  if (!made) return made.error();
  made.value().core.motion.follow_on(warm.core.motion);
  warm = std::move(made).value();
  return {};
}

// By piece.
std::vector<HeldOrder> hierarchies_of(const WarmScene& warm, const ReplacedBodies& replaced) {
  std::vector<HeldOrder> held(replaced.pieces.size());
  for (std::size_t i = 0; i < held.size(); ++i) {
    const ReplacedBodies::Piece& piece = replaced.pieces[i];
    if (piece.keeps_vertices()) held[i] = warm.pipeline->hierarchy_of(warm.core, part_of_body(piece.body));
  }
  return held;
}

// What was found of other pairs does not hold.
void filters_changed(WarmScene& warm, bool patches_change) {
  warm.pipeline->parts_changed();
  warm.pipeline->options_changed(warm.core);
  if (patches_change) warm.pipeline->patches_changed(warm.core);
}

}  // namespace

Status change_scene(WarmScene& warm, std::span<SceneChange> changes, StopSignal stop, std::size_t& at) {
  Core& core = warm.core;
  const std::uint32_t bodies_before = core.scene->body_count();
  const std::uint32_t first_vertex = core.scene->vertex_count();
  std::vector<Redescribed> others = redescribed(*core.scene, changes);
  ReplacedBodies replaced;
  Result<Scene> changed = core.scene->with_changes(changes, at, stop, &replaced);
  if (!changed) return changed.error();
  auto scene = std::make_shared<const Scene>(std::move(changed).value());

  std::vector<double> positions;  // of what is appended
  std::vector<std::span<const double>> brought(changes.size());
  for (at = 0; at < changes.size(); ++at) {
    const auto body = brought_by(changes[at]);
    if (!body) continue;
    if (Status status = check_positions(body->positions, body->vertex_count, "positions", stop); !status)
      return status;
    brought[at] = body->positions;
    if (!replaced.any()) append(positions, body->positions, stop);
  }

  for (const Status& status : {check_thickness(scene->most_thickness(), core.options),
                               check_screws(screw_count(scene->bodies()) > 0, core.options)}) {
    if (status) continue;
    at = changes.empty() ? 0 : changes.size() - 1;
    return status;
  }
  if (replaced.whole_scene) {
    at = changes.size() - 1;
    return replace_whole_scene(warm, std::move(scene), stop);
  }
  const bool extended =
      scene->body_count() > bodies_before && !core.scene->bodies().empty() && !replaced.any();
  bool thickness_changes = false;
  const bool filters_change =
      std::ranges::any_of(changes, is_of_filters) && !(core.scene->filters() == scene->filters());
  const bool pairs_change = !std::ranges::equal(core.scene->excluded_pairs(), scene->excluded_pairs());
  const bool patches_change = filters_change && core.scene->filters().patches != scene->filters().patches;
  bool tests_more = extended || replaced.any();
  bool names_alone = !tests_more && !filters_change && !pairs_change;
  std::erase_if(others, [&](Redescribed& other) {
    const Body& from = core.scene->bodies()[other.index];
    const Body& to = scene->bodies()[other.index];
    // A half-space is where it is described anew.
    other.became_rigid |= from.half_space != to.half_space;
    other.became_rigid &= to.kind == BodyKind::kRigid;
    tests_more |= tests_itself(to) && !tests_itself(from);
    thickness_changes |= to.thickness != from.thickness;
    if (!is_modelled_alike(from, to) || other.became_rigid) {
      names_alone = false;
      return false;
    }
    return true;
  });
  if (names_alone) {
    if (std::ranges::equal(core.scene->bodies(), scene->bodies())) return {};
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
  if (tests_more || filters_change) {
    if (Status status = check_rings(*scene, stop, &hub); !status) {
      at = filters_change ? last_of_filters(changes)
                          : blamed(scene->body_of_vertex()[hub], bodies_before, changes);
      return status;
    }
  }

  if (!extended && !replaced.any() && !pairs_change &&
      others.empty()) {  // and so a scene without declared bodies
    core.workers->run([&] { core.filter = core.make_filter(scene->filters(), core.model, stop); });
    core.scene = std::move(scene);
    filters_changed(warm, patches_change);
    return {};
  }
  std::optional<Growth> growth;
  std::optional<Core::Parts> parts;
  std::optional<CoreReplacement> replacement;
  if (extended) growth.emplace(core);
  core.workers->run([&] {
    for (Redescribed& other : others) {
      core.motion.settle(part_of_body(other.index), stop);
      if (other.became_rigid)
        other.shape = core.motion.shape_of(part_of_body(other.index), stop);
      else if (other.kind != core.scene->bodies()[other.index].kind)
        other.reach = core.motion.measured_reach(part_of_body(other.index), stop);
    }
    if (extended) {
      core.motion.append(*scene, positions, stop);
      core.topology->extend(*scene, core.motion.vertices(), stop);
      core.motion.renumber(core.topology->numbering, first_vertex, stop);
    }
    if (replaced.any())
      replacement.emplace(core, *scene, replaced, brought, hierarchies_of(warm, replaced), stop);
    else
      parts = core.make_parts(*scene, *scene, extended, stop);
  });
  if (growth) growth->keep();
  if (replacement) replacement->take(*scene);
  for (Redescribed& other : others)
    core.motion.change_kind(part_of_body(other.index), other.kind, std::move(other.shape), other.reach);
  core.scene = std::move(scene);
  if (replacement) {
    warm.pipeline->parts_replaced(core, replacement->changes());
  } else {
    core.take(std::move(*parts));
    warm.pipeline->parts_changed();
  }
  if (filters_change) filters_changed(warm, patches_change);
  if (thickness_changes) warm.pipeline->thickness_changed(core);
  return {};
}

}  // namespace warmfront
