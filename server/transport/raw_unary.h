// SPDX-License-Identifier: Apache-2.0
// Unary methods whose messages come and go as bytes: who calls is known before the first of them is parsed,
// and nothing that is thrown, by parsing or later, leaves the method. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>

#include "proto/byte_buffer.h"
#include "server/transport/context.h"
#include "server/transport/reaction.h"
#include "server/transport/stream_codec.h"
#include "warmfront/v1/collision_service.pb.h"

namespace warmfront::server {

/// A call's request, and who sent it.
template <class Request>
struct Received {
  Principal principal;
  ParseRoom::Place place;
  Request message;
};

/// A request of ids and flags is no longer than this, and is parsed at once, in the reaction.
inline constexpr std::size_t kMostOfSmall = std::size_t{64} << 10;
template <class Request>
inline constexpr bool kIsSmall =
    !std::is_same_v<Request, v1::StepRequest> && !std::is_same_v<Request, v1::ChangeSceneRequest>;

/// `principal` as told by the guard: its fault wins, and then no byte is looked at. INVALID_ARGUMENT for
/// bytes that are no message, and for more of them than such a request can need; `method` names them. Fails
/// as ParseRoom::enter() does too.
template <class Request>
Outcome<Received<Request>> receive_from(Outcome<Principal> principal, Context& context,
                                        const grpc::ByteBuffer& bytes, const char* method) {
  if (!principal) return principal.fault();
  if (kIsSmall<Request> && bytes.Length() > kMostOfSmall)
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 std::string(method) + ": a message of " + std::to_string(bytes.Length()) +
                     " bytes, where ids and flags are expected; send at most " +
                     std::to_string(kMostOfSmall)};
  Outcome<Parsed<Request>> parsed = parse_message<Request>(context.parsing, bytes, method);
  if (!parsed) return parsed.fault();
  auto& [place, message] = parsed.value();
  return Received<Request>{std::move(principal).value(), std::move(place), std::move(message)};
}

/// From whoever the guard knows.
template <class Request>
Outcome<Received<Request>> receive(Context& context, const grpc::CallbackServerContext& call,
                                   const grpc::ByteBuffer& bytes, const char* method) {
  return receive_from<Request>(context.identify(call), context, bytes, method);
}

/// A method that is answered at once. `receive` returns what was received; `fill` fills the response, and the
/// status that it returns ends the call.
template <class Request, class Response, class Receive, class Fill>
grpc::ServerUnaryReactor* raw_unary(Context& context, grpc::CallbackServerContext& call,
                                    grpc::ByteBuffer& response, Receive receive, Fill fill) noexcept {
  grpc::ServerUnaryReactor* reactor = call.DefaultReactor();
  answer(*reactor, [&]() -> grpc::Status {
    const Outcome<Received<Request>> received = receive();
    if (!received) return context.refuse(received.fault());
    Response reply;
    grpc::Status status = fill(received.value(), reply);
    if (status.ok()) response = serialize(reply);
    return status;
  });
  return reactor;
}

}  // namespace warmfront::server
