// SPDX-License-Identifier: Apache-2.0
// Faults to statuses. Thread-safe.
#include "server/transport/errors.h"

#include <string>
#include <string_view>

#include "proto/wire/codes.h"

namespace warmfront::server {
namespace {

v1::ErrorReason to_proto(Reason reason) {
  switch (reason) {
    case Reason::kInvalidInput:
      return v1::ERROR_REASON_INVALID_INPUT;
    case Reason::kSessionNotFound:
      return v1::ERROR_REASON_SESSION_NOT_FOUND;
    case Reason::kSessionExists:
      return v1::ERROR_REASON_SESSION_EXISTS;
    case Reason::kSessionAttached:
      return v1::ERROR_REASON_SESSION_ATTACHED;
    case Reason::kFrameOutOfOrder:
      return v1::ERROR_REASON_FRAME_OUT_OF_ORDER;
    case Reason::kFrameChanged:
      return v1::ERROR_REASON_FRAME_CHANGED;
    case Reason::kProtocol:
      return v1::ERROR_REASON_PROTOCOL;
    case Reason::kLimit:
      return v1::ERROR_REASON_LIMIT;
    case Reason::kDraining:
      return v1::ERROR_REASON_DRAINING;
    case Reason::kEngine:
      return v1::ERROR_REASON_ENGINE;
    case Reason::kTimeout:
      return v1::ERROR_REASON_TIMEOUT;
    case Reason::kCancelled:
      return v1::ERROR_REASON_CANCELLED;
    case Reason::kUnauthenticated:
      return v1::ERROR_REASON_UNAUTHENTICATED;
    case Reason::kPermissionDenied:
      return v1::ERROR_REASON_PERMISSION_DENIED;
    case Reason::kDataLoss:
      return v1::ERROR_REASON_DATA_LOSS;
    case Reason::kStateChanged:
      return v1::ERROR_REASON_STATE_CHANGED;
  }
  return v1::ERROR_REASON_UNSPECIFIED;
}

// Of google.rpc: the same bytes as of our message, whose own name it has not.
void add(v1::Status& status, const char* name, const google::protobuf::Message& message) {
  google::protobuf::Any& any = *status.add_details();
  any.set_type_url(std::string("type.googleapis.com/google.rpc.") + name);
  any.set_value(message.SerializeAsString());
}

void add_error_info(const Fault& fault, v1::ErrorReason reason, v1::Status& status) {
  constexpr std::size_t kPrefix = std::string_view("ERROR_REASON_").size();
  v1::ErrorInfo info;
  info.set_reason(v1::ErrorReason_Name(reason).substr(kPrefix));
  info.set_domain("warmfront.v1");
  if (fault.expected_frame)
    (*info.mutable_metadata())["expected_frame"] = std::to_string(*fault.expected_frame);
  if (*fault.limit != '\0') (*info.mutable_metadata())["limit"] = fault.limit;
  add(status, "ErrorInfo", info);
}

void add_retry_info(std::chrono::milliseconds after, v1::Status& status) {
  v1::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(after.count() / 1000);
  retry.mutable_retry_delay()->set_nanos(static_cast<std::int32_t>(after.count() % 1000) * 1'000'000);
  add(status, "RetryInfo", retry);
}

void add_quota_failure(const Fault& fault, v1::Status& status) {
  v1::QuotaFailure failure;
  v1::QuotaFailure::Violation& violation = *failure.add_violations();
  violation.set_subject(std::string("limit:") + fault.limit);
  violation.set_description(fault.message);
  add(status, "QuotaFailure", failure);
}

}  // namespace

grpc::StatusCode to_grpc_code(ErrorCode code) {
  return static_cast<grpc::StatusCode>(wire::canonical_code(code));
}

v1::Status to_proto(const Fault& fault) {
  v1::ErrorDetail detail;
  detail.set_reason(to_proto(fault.reason));
  if (fault.expected_frame) detail.set_expected_frame(*fault.expected_frame);
  detail.set_limit(fault.limit);
  if (fault.retry_after) detail.set_retry_after_ms(static_cast<std::uint64_t>(fault.retry_after->count()));
  v1::Status status;
  status.set_code(to_grpc_code(fault.code));
  status.set_message(fault.message);
  status.add_details()->PackFrom(detail);
  add_error_info(fault, detail.reason(), status);
  if (fault.retry_after) add_retry_info(*fault.retry_after, status);
  if (fault.reason == Reason::kLimit && *fault.limit != '\0') add_quota_failure(fault, status);
  return status;
}

grpc::Status to_grpc(const Fault& fault) {
  return {to_grpc_code(fault.code), fault.message, to_proto(fault).SerializeAsString()};
}

}  // namespace warmfront::server
