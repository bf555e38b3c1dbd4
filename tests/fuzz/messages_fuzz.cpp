// SPDX-License-Identifier: Apache-2.0
// Any bytes as a message of StreamSteps, cut into slices anywhere: parsed whole or refused with
// INVALID_ARGUMENT, the same when it is read in place, and what was parsed says the same when it is sent
// again. A frame in it, whole or of what moved, is then stepped or refused with words. One thread.
#include <grpcpp/grpcpp.h>

#include <vector>

#include "server/transport/convert.h"
#include "server/transport/stream_codec.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/session_model.h"

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

void step_or_refuse(const warmfront::v1::StepFrame& message) {
  using namespace warmfront;
  static const auto workers = std::make_shared<Workers>(1);
  static const auto scene =
      std::make_shared<const Scene>(Scene::create(fuzz::tiny_scene(BodyKind::kRigid)).value());
  server::FrameBuffer contents(server::Dtype::kFloat64, *scene);
  server::append(message, contents);
  const Status complete = contents.complete(*scene);
  expect(complete.ok() ||
             (complete.error().code == ErrorCode::kInvalidArgument && !complete.error().message.empty()),
         "a frame is complete or refused with words");
  if (!complete) return;
  const std::vector<double> start = fuzz::tiny_positions(0);
  Collider collider = Collider::create(scene, std::span<const double>(start), {}, workers).value();
  const auto result = collider.step(contents.view());
  expect(result.ok() || (result.error().code == ErrorCode::kInvalidArgument &&
                         !result.error().message.empty() && collider.positions() == start),
         "and stepped, or refused with nothing changed");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace warmfront;
  fuzz::Bytes input(data, size);
  const std::size_t piece = std::size_t{1} + input.next();
  grpc::ByteBuffer buffer = buffer_of(input.rest(), piece);
  grpc::ByteBuffer in_place = buffer_of(input.rest(), piece);
  const auto request = server::parse_request(buffer);
  static server::ParseRoom room(32 << 20);
  const auto read = server::read_request(in_place, room);
  expect(read.ok() == request.ok(), "a message read in place is one");
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
  v1::StreamStepsRequest whole = read.value().message;
  if (whole.has_step()) *whole.mutable_step() = read.value().whole_step();
  expect(whole.SerializeAsString() == bytes, "and says what it says when it is parsed");
  grpc::ByteBuffer again = buffer_of(bytes, bytes.size() + 1);
  const auto second = server::parse_request(again);
  expect(second.ok() && second.value().SerializeAsString() == bytes,
         "a message that was parsed survives being sent again");
  if (message.has_step()) step_or_refuse(message.step());
  return 0;
}
