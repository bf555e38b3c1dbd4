// SPDX-License-Identifier: Apache-2.0
// The target of a replay: the engine in this process, or a daemon. Used by one thread at a time.
#pragma once

#include <memory>
#include <string>

#include "client/cli/recording/answer_digest.h"
#include "client/cli/recording/recorded_session.h"
#include "client/lib/client.h"

namespace warmfront::client {

class ReplayTarget {
 public:
  virtual ~ReplayTarget() = default;
  /// Steps to the next frame. kInvalidArgument if it is refused; the state is then unchanged.
  virtual Result<AnswerDigest> step(const RecordedStep& step) = 0;
  virtual Status change(const v1::ChangeSceneRequest& request) = 0;
};

/// `threads` as make_local_stepper() has them. Fails as Scene::create() and Collider::create() do.
Result<std::unique_ptr<ReplayTarget>> make_engine_target(const RecordedSession& recorded, int threads);

/// A new session of the daemon, with its own id; messages are sent as recorded. It is deleted at the end and
/// never resumed: if the daemon loses it, step() fails.
Result<std::unique_ptr<ReplayTarget>> make_remote_target(const RecordedSession& recorded,
                                                         const std::string& address,
                                                         const ClientOptions& connection);

}  // namespace warmfront::client
