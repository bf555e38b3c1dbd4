// SPDX-License-Identifier: Apache-2.0
// A session in this process or behind a daemon, as one type, for programs that are written once. Used by one
// thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "client/lib/answer.h"
#include "client/lib/client.h"
#include "client/lib/questions.h"
#include "engine/collider.h"

namespace warmfront::client {

class LocalSession;

/// The questions of Session, with the same bits wherever they are computed. Errors have the same codes; a
/// session behind a daemon also has those of its connection. In this process, what is asked without waiting
/// is computed on a thread of the session's own.
class AnySession final : public Questions {
 public:
  /// In this process. Fails as Scene::create() and Collider::create() do. Filters that need a rest shape and
  /// have none take these positions. Without `workers` it has its own, one thread per core.
  static Result<AnySession> create(SceneDescription scene, const Positions& positions,
                                   const ColliderOptions& options = {},
                                   std::shared_ptr<Workers> workers = nullptr);
  /// Behind a daemon: see Client::create_session().
  AnySession(Session session) : held_(std::move(session)) {}  // NOLINT: a session is one

  /// Whether a daemon computes the answers.
  bool is_remote() const { return std::holds_alternative<Session>(held_); }

  /// Each as Session's function of that name.
  Result<std::vector<double>> positions() const;
  Result<std::vector<BodyPose>> poses() const;
  Result<std::uint32_t> add_body(BodyAddition addition, const Positions& positions);
  Status replace_elements(std::uint32_t index, std::vector<std::array<std::int32_t, 3>> faces,
                          std::vector<std::array<std::int32_t, 2>> edges = {});
  Status replace_body(std::uint32_t index, BodyAddition with, const Positions& positions);
  Status change_body(std::uint32_t index, Body body);
  Status change_filters(PairFilters filters);
  Status change_excluded_pairs(std::vector<std::array<std::uint32_t, 2>> pairs);
  Status change_options(const ColliderOptions& options);
  Status change(std::vector<SceneChange> changes,
                const std::optional<ColliderOptions>& options = std::nullopt);

 private:
  explicit AnySession(std::shared_ptr<LocalSession> local);
  std::shared_ptr<PendingAnswer> ask(const Frame& frame, const Question& question, const WaitOptions& wait,
                                     bool handed_out) override;
  std::shared_ptr<PendingAnswer> ask_commit(double fraction, const WaitOptions& wait,
                                            bool handed_out) override;

  // No other holds a local one, but for a Pending that waits.
  std::variant<std::shared_ptr<LocalSession>, Session> held_;
};

}  // namespace warmfront::client
