// SPDX-License-Identifier: Apache-2.0
// Conversion between the wire's messages and the client library's values. Thread-safe.
#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <optional>
#include <string>

#include "client/lib/answer.h"
#include "client/lib/shared_region.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "proto/wire/filters.h"
#include "proto/wire/options.h"
#include "proto/wire/question.h"
#include "proto/wire/scene.h"
#include "proto/wire/statistics.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

using wire::to_proto;
/// Of a session. kInvalidArgument for what is of one question alone, and a daemon's session has not.
Result<v1::ColliderOptions> session_options(const ColliderOptions& options);

ServerInfo server_info_from(const v1::GetServerInfoResponse& message);
SessionInfo session_info_from(const v1::SessionInfo& message);

/// Appends the rows. kInternal when the columns' lengths differ, or a value is not in its enum.
Status append_columns(const v1::ContactColumns& message, ContactTable& contacts);
/// Appends what a part of an answer lists. kInternal as append_columns(), and for distances that are none.
/// `room`: of the daemon's memory, where the answer may be.
Status append_part(const v1::StepAnswer& message, Answer& answer,
                   const std::optional<SharedRegion::Block>& room = std::nullopt);
/// Everything except what is listed. kInternal when the summary's counts differ from that of the rows or
/// distances.
Status finish_answer(const v1::StepAnswer& message, Answer& answer);
/// Why a call or a frame failed.
struct RemoteError {
  Error error;
  /// UNSPECIFIED for gRPC's own errors: the daemon was not reached, or died.
  v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED;
  /// Suggested delay before a retry, for limits that other sessions use up.
  std::optional<std::chrono::milliseconds> retry_after = std::nullopt;

  /// The daemon no longer has the session.
  bool lost_session() const;
  /// The daemon has the session in another state than this client's.
  bool other_state() const;
  /// Can a resume help: creating the session again, or retrying?
  bool may_resume() const;
};
bool same_state(const v1::SessionState& a, const v1::SessionState& b);

RemoteError remote_error_from(const grpc::Status& status);
RemoteError remote_error_from(const v1::Status& status);

}  // namespace warmfront::client
