// SPDX-License-Identifier: Apache-2.0
// warmfront.v1.AdminService over a context. Thread-safe.
#pragma once

#include <memory>

#include "server/transport/context.h"

namespace grpc {
class Service;
}

namespace warmfront::server {

/// `context` outlives the service and every call of it.
std::unique_ptr<grpc::Service> make_admin_service(Context& context);

}  // namespace warmfront::server
