// SPDX-License-Identifier: Apache-2.0
// By what a call is found again in the logs of those it passed through. Plain values; thread-safe.
#pragma once

#include <grpcpp/server_context.h>

#include <string>
#include <string_view>

namespace warmfront::server {

struct CallTag {
  std::string request_id;   ///< the metadata `x-request-id`, or one made up here
  std::string traceparent;  ///< what is known of the metadata of that name (wire::TraceContext); empty
                            ///< without, or when it has another shape
};

/// What has another shape than an id should have, or is too long for one, is not taken over into logs.
CallTag call_tag(const grpc::ServerContextBase& call);

/// The call's `traceparent`, whatever its shape; empty without. Valid as long as the call.
std::string_view traceparent(const grpc::ServerContextBase& call);

}  // namespace warmfront::server
