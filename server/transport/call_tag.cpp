// SPDX-License-Identifier: Apache-2.0
// Reading and making ids. Thread-safe.
#include "server/transport/call_tag.h"

#include <algorithm>
#include <random>
#include <string_view>

#include "proto/wire/trace_context.h"

namespace warmfront::server {
namespace {

std::string_view metadata(const grpc::ServerContextBase& call, const char* name) {
  const auto found = call.client_metadata().find(name);
  if (found == call.client_metadata().end()) return {};
  return {found->second.data(), found->second.size()};
}

bool is_request_id(std::string_view text) {
  return !text.empty() && text.size() <= 128 && std::ranges::all_of(text, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' ||
           c == '_' || c == '.' || c == '/' || c == '+' || c == '=' || c == ':';
  });
}

std::string made_up_id() {
  thread_local std::mt19937_64 random{std::random_device{}()};
  std::string id(16, '0');
  std::uint64_t bits = random();
  for (char& c : id) {
    c = "0123456789abcdef"[bits & 15];
    bits >>= 4;
  }
  return id;
}

}  // namespace

std::string_view traceparent(const grpc::ServerContextBase& call) {
  return metadata(call, "traceparent");
}

CallTag call_tag(const grpc::ServerContextBase& call) {
  const std::string_view request = metadata(call, "x-request-id"), trace = traceparent(call);
  return {is_request_id(request) ? std::string(request) : made_up_id(),
          wire::TraceContext::parse(trace) ? std::string(trace.substr(0, wire::kTraceparentLength))
                                           : std::string()};
}

}  // namespace warmfront::server
