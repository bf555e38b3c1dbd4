// SPDX-License-Identifier: Apache-2.0
// A client's credentials from files. Thread-safe.
#pragma once

#include <grpcpp/security/credentials.h>

#include <memory>
#include <string>
#include <string_view>

#include "client/lib/client.h"
#include "engine/result.h"

namespace warmfront::client {

struct Credentials {
  std::shared_ptr<grpc::ChannelCredentials> channel;
  std::string server_name;    ///< expected instead of the address's host; may be empty
  std::string authorization;  ///< the metadata's value; may be empty
  bool encrypted = false;
};

/// kInvalidArgument for files that cannot be read or are no PEM, a certificate without its key or the
/// reverse, and a token that would be sent unencrypted to another machine.
Result<Credentials> read_credentials(const std::string& address, const ClientSecurity& security);

/// Where no connection came about, by gRPC's words, and these credentials and the daemon's may not fit.
std::string what_to_try(std::string_view why, bool encrypted);

}  // namespace warmfront::client
