// SPDX-License-Identifier: Apache-2.0
// A session in this process or behind a daemon, as one type, for programs that are written once. Used by one
// thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>

#include "client/lib/answer.h"
#include "client/lib/client.h"
#include "engine/collider.h"

namespace warmfront::client {

/// The questions of Collider and Session, with one kind of answers: the same bits, wherever they are
/// computed. Errors have the same codes; a session behind a daemon also has those of its connection.
class AnySession {
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
  Result<Answer> step(const Frame& frame, const QuestionOptions& options = {});
  Result<Answer> place(const Frame& frame);
  Result<Answer> trial(const Frame& frame, const QuestionOptions& options = {});
  Result<MaxStep> max_step(const Frame& frame, bool leave_out_overlaps = false,
                           const QuestionOptions& options = {});
  Result<Answer> proximity(double distance, Where where = Where::kBase, const QuestionOptions& options = {});
  Result<Answer> vertex_distances(double distance, Where where = Where::kBase,
                                  const QuestionOptions& options = {});
  Result<Answer> intersections(Where where = Where::kBase, const QuestionOptions& options = {});
  Result<CommitResult> commit(double fraction = 1);
  Result<std::uint32_t> add_body(BodyAddition addition, const Positions& positions);
  Status change_body(std::uint32_t index, Body body);
  Status change_filters(PairFilters filters);

 private:
  struct Local {
    Collider collider;
    Rounding rounding;        // of commits: by the kind of positions that it was created with
    std::uint64_t frame = 0;  // the last
    Result<Answer> ask(const Frame& frame, const Question& question);
  };

  explicit AnySession(Local local) : held_(std::move(local)) {}

  std::variant<Local, Session> held_;
};

}  // namespace warmfront::client
