// SPDX-License-Identifier: Apache-2.0
#include "client/lib/any_session.h"

#include <utility>

#include "client/lib/changes_in_one.h"
#include "client/lib/local_session.h"

namespace warmfront::client {

AnySession::AnySession(std::shared_ptr<LocalSession> local) : held_(std::move(local)) {}

Result<AnySession> AnySession::create(SceneDescription description, const Positions& positions,
                                      const ColliderOptions& options, std::shared_ptr<Workers> workers) {
  if (workers == nullptr) workers = std::make_shared<Workers>(0);
  description.filters.rest_at(positions);
  Result<Scene> scene = Scene::create(std::move(description));
  if (!scene) return scene.error();
  Result<Collider> collider = Collider::create(std::make_shared<const Scene>(std::move(scene).value()),
                                               positions, options, std::move(workers));
  if (!collider) return collider.error();
  const bool single = std::holds_alternative<std::span<const float>>(positions);
  return AnySession(std::make_shared<LocalSession>(std::move(collider).value(),
                                                   single ? Rounding::kFloat32 : Rounding::kFloat64));
}

std::shared_ptr<PendingAnswer> AnySession::ask(const Frame& frame, const Question& question,
                                               const WaitOptions& wait, bool handed_out) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->ask(frame, question, wait, handed_out);
  return std::get<std::shared_ptr<LocalSession>>(held_)->ask({frame, question}, wait, handed_out);
}

std::shared_ptr<PendingAnswer> AnySession::ask_commit(double fraction, const WaitOptions& wait,
                                                      bool handed_out) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->ask_commit(fraction, wait, handed_out);
  return std::get<std::shared_ptr<LocalSession>>(held_)->ask({.commit = fraction}, wait, handed_out);
}

Result<std::vector<double>> AnySession::positions() const {
  if (const auto* remote = std::get_if<Session>(&held_)) return remote->positions();
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle.error();
  return local.collider().positions();
}

Result<std::vector<BodyPose>> AnySession::poses() const {
  if (const auto* remote = std::get_if<Session>(&held_)) return remote->poses();
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle.error();
  return local.collider().poses();
}

Result<std::uint32_t> AnySession::add_body(BodyAddition addition, const Positions& positions) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->add_body(std::move(addition), positions);
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle.error();
  if (Status kind = local.check_kind(positions, "positions"); !kind) return kind.error();
  return local.collider().add_body(std::move(addition), positions);
}

Status AnySession::replace_elements(std::uint32_t index, std::vector<std::array<std::int32_t, 3>> faces,
                                    std::vector<std::array<std::int32_t, 2>> edges) {
  if (auto* remote = std::get_if<Session>(&held_))
    return remote->replace_elements(index, std::move(faces), std::move(edges));
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle;
  return local.collider().replace_elements(index, std::move(faces), std::move(edges));
}

Status AnySession::replace_body(std::uint32_t index, BodyAddition with, const Positions& positions) {
  if (auto* remote = std::get_if<Session>(&held_))
    return remote->replace_body(index, std::move(with), positions);
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle;
  if (Status kind = local.check_kind(positions, "positions"); !kind) return kind;
  return local.collider().replace_body(index, std::move(with), positions);
}

Status AnySession::change_body(std::uint32_t index, Body body) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->change_body(index, std::move(body));
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle;
  return local.collider().change_body(index, std::move(body));
}

Status AnySession::change_filters(PairFilters filters) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->change_filters(std::move(filters));
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle;
  return local.collider().change_filters(std::move(filters));
}

Status AnySession::change_excluded_pairs(std::vector<std::array<std::uint32_t, 2>> pairs) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->change_excluded_pairs(std::move(pairs));
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle;
  return local.collider().change_excluded_pairs(std::move(pairs));
}

Status AnySession::change(std::vector<SceneChange> changes, const std::optional<ColliderOptions>& options) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->change(std::move(changes), options);
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle;
  if (changes.empty() && !options) return {};
  if (local.float32()) {
    if (Status exact = check_float32(changes); !exact) return exact;
  }
  const std::size_t count = changes.size();
  std::size_t failed = 0;
  const Status changed = local.collider().change(std::move(changes), nullptr, &failed, options);
  if (changed) return changed;
  const std::string where = failed < count ? "changes[" + std::to_string(failed) + "]: " : "options.";
  return Error{changed.error().code, where + changed.error().message};
}

Status AnySession::change_options(const ColliderOptions& options) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->change_options(options);
  LocalSession& local = *std::get<std::shared_ptr<LocalSession>>(held_);
  if (Status idle = local.check_idle(); !idle) return idle;
  return local.collider().change_options(options);
}

}  // namespace warmfront::client
