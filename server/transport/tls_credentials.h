// SPDX-License-Identifier: Apache-2.0
// gRPC served with the certificates in force. Thread-safe.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/admin/certificates.h"

namespace warmfront::server {

/// Each handshake takes what is in force by then. gRPC reads no file for it, and is handed nothing that was
/// not proved to serve.
std::shared_ptr<grpc::ServerCredentials> tls_credentials(std::shared_ptr<Certificates> certificates);

}  // namespace warmfront::server
