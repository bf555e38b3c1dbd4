// SPDX-License-Identifier: Apache-2.0
// The messages of StreamSteps to and from raw buffers. A typed stream reports bytes that are no message just
// as it reports a clean half-close; parsing them here tells the two apart. Thread-safe.
#pragma once

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/fault.h"
#include "server/session/answer.h"
#include "server/transport/parse_room.h"
#include "server/transport/stream_memory.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// INVALID_ARGUMENT for bytes that are no message, and for a message that carries none of step, attach,
/// detach and commit. `buffer` is consumed.
Outcome<v1::StreamStepsRequest> parse_request(grpc::ByteBuffer& buffer);

/// The same of a call's message of any type, with its place in the room; `call` is the method's name. Fails
/// as ParseRoom::enter() does too.
template <class Message>
Outcome<Parsed<Message>> parse_message(ParseRoom& room, grpc::ByteBuffer buffer, const char* call) {
  const std::size_t size = buffer.Length();
  Outcome<ParseRoom::Place> place = room.enter(buffer, layout_of<Message>(), call);
  if (!place) return place.fault();
  Parsed<Message> parsed{std::move(place).value(), {}};
  if (!grpc::SerializationTraits<Message>::Deserialize(&buffer, &parsed.message).ok())
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 std::string(call) + ": " + std::to_string(size) + " bytes are no " +
                     Message::descriptor()->full_name()};
  return parsed;
}

/// A request, of which a step's positions may be left where they arrived: they are most of it, and the
/// session puts them into its own memory anyway.
struct StreamRequest {
  ParseRoom::Place place;  ///< none when the positions are left where they are
  v1::StreamStepsRequest message;
  std::vector<std::string_view> positions;  ///< a step's, one after the other, when the message has none
  std::optional<MovedPiece> moved;          ///< likewise what moved

  /// The step with its positions in it.
  v1::StepFrame whole_step() const;
};

/// As parse_request(), but `buffer` must live, and stay as it is, for as long as `positions` are used. Fails
/// as ParseRoom::enter() does too.
Outcome<StreamRequest> read_request(grpc::ByteBuffer& buffer, ParseRoom& room);

/// An answer in chunks of at most `chunk_bytes` of contacts or distances (at least one each), the last one
/// marked and with the summary; each is encoded when it is taken. An answer without rows is one chunk. Used
/// by one thread at a time.
class AnswerChunks {
 public:
  /// Into `room` where it fits there.
  AnswerChunks(std::shared_ptr<const Answer> answer, std::size_t chunk_bytes, AnswerRoom room = {});

  bool done() const { return done_; }
  /// Unless done. When it throws, nothing was taken.
  grpc::ByteBuffer next();
  std::uint64_t frame() const { return answer_->frame; }
  std::size_t answer_bytes() const { return answer_->memory_bytes(); }
  /// Nobody looks there any more.
  void forget_room() { room_ = {}; }

 private:
  // Does it tell of vertices, and has no rows?
  bool by_vertex() const { return !answer_->vertex_distances.empty(); }

  grpc::ByteBuffer last_part(v1::StreamStepsResponse& response);

  // How many worlds go with so many rows.
  std::size_t next_worlds(std::size_t rows) const;

  std::shared_ptr<const Answer> answer_;
  std::size_t chunk_bytes_;
  std::size_t items_;
  std::size_t items_per_chunk_;
  AnswerRoom room_;
  std::size_t first_ = 0;
  std::size_t first_world_ = 0;
  bool done_ = false;
};

grpc::ByteBuffer encode_error(std::uint64_t frame, const Fault& fault);

}  // namespace warmfront::server
