// SPDX-License-Identifier: Apache-2.0
// Where a recording is replayed: the engine in this process, or a daemon. Used by one thread at a time.
#pragma once

#include <memory>
#include <string>

#include "client/cli/answer_digest.h"
#include "client/cli/recording/recorded_session.h"
#include "client/lib/client.h"

namespace warmfront::client {

class ReplayTarget {
 public:
  virtual ~ReplayTarget() = default;
  /// Steps to the frame that is next. kInvalidArgument for one that is refused; the state is as before it
  /// then.
  virtual Result<AnswerDigest> step(const RecordedStep& step) = 0;
  virtual Status change(const v1::ChangeSceneRequest& request) = 0;
};

/// `threads` as make_local_stepper() has them. Fails as Scene::create() and Collider::create() do.
Result<std::unique_ptr<ReplayTarget>> make_engine_target(const RecordedSession& recorded, int threads);

/// A new session of the daemon, with an id of its own; messages go to it as they were recorded. It is deleted
/// at the end. It is not resumed: what the daemon forgets is an error of step().
Result<std::unique_ptr<ReplayTarget>> make_remote_target(const RecordedSession& recorded,
                                                         const std::string& address,
                                                         const ClientSecurity& security);

}  // namespace warmfront::client
