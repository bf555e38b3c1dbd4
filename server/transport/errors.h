// SPDX-License-Identifier: Apache-2.0
// The one place where faults become statuses of the wire. Thread-safe.
#pragma once

#include <grpcpp/support/status.h>

#include "server/fault.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

grpc::StatusCode to_grpc_code(ErrorCode code);

/// The status as a message: within a stream, and the trailer `grpc-status-details-bin`.
v1::Status to_proto(const Fault& fault);

/// The status that ends a call, details included.
grpc::Status to_grpc(const Fault& fault);

}  // namespace warmfront::server
