// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/collision_model.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <unordered_map>

#include "engine/scene/held_bytes.h"

namespace warmfront {
namespace {

std::uint64_t key(PartId p, PartId q) {
  return std::uint64_t{number_of(std::min(p, q))} << 32 | number_of(std::max(p, q));
}

}  // namespace

CollisionModel::CollisionModel(const Scene& scene, StopSignal stop) {
  PacedStop paced(stop);
  if (scene.bodies().empty()) {
    const bool holds_any = scene.vertex_count() > 0;
    sets_.push_back(holds_any ? Set{1, 0xffffffff, true} : Set{});
    self_.push_back(holds_any ? 1 : 0);
    return;
  }
  sets_.reserve(scene.bodies().size());
  self_.reserve(scene.bodies().size());
  for (const Body& body : scene.bodies()) {
    paced.check();
    const bool gone = body.kind == BodyKind::kRemoved;
    Set set{body.group, body.mask, body.kind != BodyKind::kStatic};
    set.put_in(body.world);
    const PartId part{static_cast<std::uint32_t>(sets_.size())};
    if (body.half_space && !gone) half_spaces_.push_back({part, set, *body.half_space, body.thickness});
    if (body.screw && !gone) screws_.push_back(part);
    sets_.push_back(gone || body.half_space ? Set{} : set);
    self_.push_back(body.kind == BodyKind::kDeformable && body.self_collision ? 1 : 0);
  }
  excluded_.reserve(scene.excluded_pairs().size());
  for (const auto& [a, b] : scene.excluded_pairs()) {
    paced.check();
    excluded_.insert(key(part_of_body(a), part_of_body(b)));
  }
}

bool CollisionModel::is_excluded(PartId p, PartId q) const {
  return !excluded_.empty() && excluded_.contains(key(p, q));
}

bool CollisionModel::may_meet(PartId p, PartId q) const {
  if (p == q) return self_collision(p);
  return set_of(p).may_meet(set_of(q)) && !is_excluded(p, q);
}

std::uint64_t CollisionModel::excluded_pairs(StopSignal stop) const {
  PacedStop paced(stop);
  // Parts with equal properties are counted together: those of each world, and all of those looked at.
  using Classes = std::map<std::tuple<std::uint32_t, std::uint32_t, bool>, std::uint64_t>;
  Classes all;
  std::unordered_map<std::uint32_t, Classes> of_world;
  std::uint64_t alive = 0;
  std::uint64_t kept = 0;
  for (PartId p{0}; p < end_part(); ++p) {
    if (is_removed(p)) continue;
    ++alive;
    kept += self_collision(p) ? 1 : 0;
    const Set& set = set_of(p);
    const auto keep_with = [&](const Classes& classes) {
      for (const auto& [other, count] : classes) {
        paced.check();
        const auto& [groups, masks, moving] = other;
        if (set.may_meet({groups, masks, moving})) kept += count;
      }
    };
    Classes& own = of_world[world_of(p)];
    if (world_of(p) == 0) {
      keep_with(all);
    } else {
      keep_with(own);
      keep_with(of_world[0]);
    }
    ++own[{set.groups, set.masks, set.moving}];
    ++all[{set.groups, set.masks, set.moving}];
  }
  for (const std::uint64_t pair : excluded_) {
    paced.check();
    if (sets_[pair >> 32].may_meet(sets_[pair & 0xffffffff])) --kept;
  }
  return alive * (alive + 1) / 2 - kept;
}

std::size_t CollisionModel::memory_bytes() const {
  constexpr std::size_t kOfNode =
      4 * sizeof(void*);  // of libstdc++'s hash set: link, key, and the allocator's
  return held_bytes(half_spaces_, screws_, sets_, self_) + excluded_.size() * kOfNode +
         excluded_.bucket_count() * sizeof(void*);
}

}  // namespace warmfront
