// SPDX-License-Identifier: Apache-2.0
// warmfront.v1.CollisionService over a context. Thread-safe.
#pragma once

#include <memory>

#include "server/transport/context.h"

namespace grpc {
class Service;
}

namespace warmfront::server {

inline constexpr const char* kServiceName = "warmfront.v1.CollisionService";

/// `context` outlives the service and every call of it.
std::unique_ptr<grpc::Service> make_collision_service(Context& context);

}  // namespace warmfront::server
