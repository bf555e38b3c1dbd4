// SPDX-License-Identifier: Apache-2.0
// Any bytes as a message of StreamSteps, cut into slices anywhere: parsed whole or refused with
// INVALID_ARGUMENT, and what was parsed says the same when it is sent again. One thread.
#include <grpcpp/grpcpp.h>

#include <vector>

#include "server/transport/stream_codec.h"
#include "tests/fuzz/expect.h"

namespace {

using warmfront::fuzz::expect;

grpc::ByteBuffer buffer_of(std::string_view bytes, std::size_t piece) {
  std::vector<grpc::Slice> slices;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const std::string_view part = bytes.substr(at, piece);
    slices.emplace_back(part.data(), part.size());
  }
  return {slices.data(), slices.size()};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace warmfront;
  fuzz::Bytes input(data, size);
  const std::size_t piece = std::size_t{1} + input.next();
  grpc::ByteBuffer buffer = buffer_of(input.rest(), piece);
  const auto request = server::parse_request(buffer);
  if (!request) {
    expect(request.fault().code == ErrorCode::kInvalidArgument,
           "bytes that are no message are INVALID_ARGUMENT");
    expect(!request.fault().message.empty(), "an error says what is wrong");
    return 0;
  }
  const v1::StreamStepsRequest& message = request.value();
  expect(message.message_case() != v1::StreamStepsRequest::MESSAGE_NOT_SET,
         "an accepted message says something");
  const std::string bytes = message.SerializeAsString();
  grpc::ByteBuffer again = buffer_of(bytes, bytes.size() + 1);
  const auto second = server::parse_request(again);
  expect(second.ok() && second.value().SerializeAsString() == bytes,
         "a message that was parsed survives being sent again");
  return 0;
}
