// SPDX-License-Identifier: Apache-2.0
// The wire's messages as the client library's values and back. Thread-safe.
#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <optional>
#include <string>

#include "client/lib/answer.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "proto/wire/options.h"
#include "proto/wire/scene.h"
#include "proto/wire/statistics.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

using wire::to_proto;

ServerInfo server_info_from(const v1::GetServerInfoResponse& message);
SessionInfo session_info_from(const v1::SessionInfo& message);

/// Appends the rows. kInternal when the columns' lengths do not fit together, or a value is none of its enum.
Status append_columns(const v1::ContactColumns& message, ContactTable& contacts);
/// Everything but the contacts. kInternal when the summary's row count is not that of `answer.contacts`.
Status finish_answer(const v1::StepAnswer& message, Answer& answer);

/// Why a call or a frame failed.
struct RemoteError {
  Error error;
  /// UNSPECIFIED when it is gRPC's own: the daemon was not reached, or died.
  v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED;
  /// After which trying again may help; with a limit that others fill.
  std::optional<std::chrono::milliseconds> retry_after = std::nullopt;

  /// The daemon has the session no more.
  bool lost_session() const;
  /// The daemon has it, but not in the state that this client knows.
  bool other_state() const;
  /// Whether the session may go on once it was resumed: creating it again, or trying again, may help.
  bool may_resume() const;
};
bool same_state(const v1::SessionState& a, const v1::SessionState& b);

RemoteError remote_error_from(const grpc::Status& status);
RemoteError remote_error_from(const v1::Status& status);

}  // namespace warmfront::client
