// SPDX-License-Identifier: Apache-2.0
// A collider's changes of its scene and options.
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "engine/collider.h"
#include "engine/scene/screws.h"
#include "engine/step/collider_impl.h"
#include "engine/step/scene_changes.h"

namespace warmfront {

Result<std::uint32_t> Collider::add_body(BodyAddition addition, const Positions& positions,
                                         const std::atomic<bool>* cancelled) try {
  impl_->forget_answers();
  std::vector<SceneChange> changes;
  changes.emplace_back(AddBody{std::move(addition), to_doubles(positions, StopSignal(cancelled))});
  if (Status status = change(std::move(changes), cancelled); !status) return status.error();
  return impl_->warm.core.scene->body_count() - 1;
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::change_body(std::uint32_t index, Body body, const std::atomic<bool>* cancelled) {
  impl_->forget_answers();
  std::vector<SceneChange> changes;
  changes.emplace_back(ChangeBody{index, std::move(body)});
  return change(std::move(changes), cancelled);
}

Status Collider::change_filters(PairFilters filters, const std::atomic<bool>* cancelled) {
  std::vector<SceneChange> changes;
  changes.emplace_back(ChangeFilters{std::move(filters)});
  return change(std::move(changes), cancelled);
}

Status Collider::change_excluded_pairs(std::vector<std::array<std::uint32_t, 2>> pairs,
                                       const std::atomic<bool>* cancelled) {
  std::vector<SceneChange> changes;
  changes.emplace_back(ChangeExcludedPairs{std::move(pairs)});
  return change(std::move(changes), cancelled);
}

Status Collider::change_options(const ColliderOptions& options) {
  return change({}, nullptr, nullptr, options);
}

Status Collider::replace_elements(std::uint32_t index, std::vector<std::array<std::int32_t, 3>> faces,
                                  std::vector<std::array<std::int32_t, 2>> edges,
                                  const std::atomic<bool>* cancelled) {
  impl_->forget_answers();
  std::vector<SceneChange> changes;
  changes.emplace_back(ReplaceElements{index, std::move(faces), std::move(edges)});
  return change(std::move(changes), cancelled);
}

Status Collider::replace_body(std::uint32_t index, BodyAddition addition, const Positions& positions,
                              const std::atomic<bool>* cancelled) try {
  impl_->forget_answers();
  std::vector<SceneChange> changes;
  changes.emplace_back(ReplaceBody{index, std::move(addition), to_doubles(positions, StopSignal(cancelled))});
  return change(std::move(changes), cancelled);
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::change(std::vector<SceneChange> changes, const std::atomic<bool>* cancelled,
                        std::size_t* failed, const std::optional<ColliderOptions>& options) try {
  impl_->forget_answers();
  std::size_t at = changes.size();
  const auto failed_with = [&](Status status) {
    if (failed != nullptr) *failed = at;
    return status;
  };
  WarmScene& warm = impl_->warm;
  // The new ones hold while the scene is changed, and stay with it.
  struct Options {
    ColliderOptions& held;
    ColliderOptions before;
    bool kept = false;
    ~Options() {
      if (!kept) held = before;
    }
  } in_force{warm.core.options, warm.core.options};
  if (options) {
    if (Status status = check_may_become(in_force.before, *options); !status) return failed_with(status);
    if (options->keep_distance) return failed_with(keep_distance_is_of_max_step());
    if (Status status = check_thickness(changes.empty() ? warm.core.scene->most_thickness() : 0, *options);
        !status)
      return failed_with(status);
    if (Status status = check_screws(changes.empty() && screw_count(warm.core.scene->bodies()) > 0, *options);
        !status)
      return failed_with(status);
    if (!keep_alike(in_force.before, *options)) warm.pipeline->forget(warm.core);
    in_force.held = *options;
  }
  if (Status status = change_scene(warm, changes, StopSignal(cancelled), at); !status)
    return failed_with(status);
  in_force.kept = true;
  impl_->restart_comparison();
  return {};
} catch (const Stopped&) {
  return was_cancelled();
}

}  // namespace warmfront
