// SPDX-License-Identifier: Apache-2.0
// Faults to statuses. Thread-safe.
#include "server/transport/errors.h"

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
  return status;
}

grpc::Status to_grpc(const Fault& fault) {
  return {to_grpc_code(fault.code), fault.message, to_proto(fault).SerializeAsString()};
}

}  // namespace warmfront::server
