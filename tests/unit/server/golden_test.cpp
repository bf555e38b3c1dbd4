// SPDX-License-Identifier: Apache-2.0
// The golden messages (proto/golden) through our own encoders and decoders: what they read and write is what
// Protocol Buffers reads and writes.
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/message_differencer.h>
#include <grpcpp/support/byte_buffer.h>
#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "client/lib/frame_message.h"
#include "server/transport/parse_room.h"
#include "server/transport/stream_codec.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {
namespace {

struct Golden {
  std::string what;
  std::string json;
  std::string bytes;
};

std::string from_hex(const std::string& hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes.push_back(static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}

grpc::ByteBuffer buffer_of(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

std::string bytes_of(const grpc::ByteBuffer& buffer) {
  grpc::Slice slice;
  EXPECT_TRUE(buffer.DumpToSingleSlice(&slice).ok());
  return {reinterpret_cast<const char*>(slice.begin()), slice.size()};
}

std::vector<Golden> golden(const std::string& message) {
  std::ifstream file(WARMFRONT_GOLDEN_MESSAGES);
  std::vector<Golden> found;
  for (const nlohmann::json& entry : nlohmann::json::parse(file))
    if (entry["message"] == message)
      found.push_back({entry["what"], entry["json"].dump(), from_hex(entry["hex"].get<std::string>())});
  return found;
}

TEST(GoldenMessages, RequestsOfAStreamAreReadAsProtocolBuffersReadsThem) {
  const std::vector<Golden> all = golden("StreamStepsRequest");
  ASSERT_GE(all.size(), 5u);
  ParseRoom room(std::size_t{64} << 20);
  for (const Golden& entry : all) {
    SCOPED_TRACE(entry.what);
    v1::StreamStepsRequest expected;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(entry.json, &expected).ok());
    grpc::ByteBuffer buffer = buffer_of(entry.bytes);
    Outcome<StreamRequest> read = read_request(buffer, room);
    ASSERT_TRUE(read) << read.fault().message;
    v1::StreamStepsRequest actual = read.value().message;
    if (actual.has_step()) *actual.mutable_step() = read.value().whole_step();
    EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(actual, expected)) << actual.DebugString();
  }
}

TEST(GoldenMessages, FramesAreWrittenAsProtocolBuffersWritesThem) {
  int frames = 0;
  for (const Golden& entry : golden("StreamStepsRequest")) {
    SCOPED_TRACE(entry.what);
    v1::StreamStepsRequest expected;
    ASSERT_TRUE(expected.ParseFromString(entry.bytes));
    if (!expected.has_step() || expected.step().has_moved()) continue;  // what moved goes as it is
    ++frames;
    const v1::StepFrame& step = expected.step();
    const client::FrameBytes positions(std::make_shared<const std::string>(step.positions()));
    const grpc::ByteBuffer written =
        client::positions_message(step.frame(), step.more(), positions, 0, positions.size(),
                                  step.has_question() ? &step.question() : nullptr);
    v1::StreamStepsRequest actual;
    ASSERT_TRUE(actual.ParseFromString(bytes_of(written)));
    EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(actual, expected)) << actual.DebugString();
  }
  EXPECT_GE(frames, 3);
}

}  // namespace
}  // namespace warmfront::server
