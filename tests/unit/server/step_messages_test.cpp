// SPDX-License-Identifier: Apache-2.0
// The frames of StreamSteps between the client's memory and the session's: sent without a copy, read where
// they arrived, and the same bytes as messages of the general kind.
#include <grpcpp/impl/codegen/proto_utils.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <numeric>
#include <random>

#include "client/lib/frame_message.h"
#include "client/lib/scene_state.h"
#include "server/session/frame_buffer.h"
#include "server/transport/stream_codec.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::server {
namespace {

/// The bytes in slices of this size.
grpc::ByteBuffer in_pieces(std::string_view bytes, std::size_t piece) {
  std::vector<grpc::Slice> slices;
  for (std::size_t at = 0; at < bytes.size(); at += piece)
    slices.emplace_back(bytes.data() + at, std::min(piece, bytes.size() - at));
  return {slices.data(), slices.size()};
}

std::string flat(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(buffer.Dump(&slices).ok());
  std::string bytes;
  for (const grpc::Slice& slice : slices)
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return bytes;
}

std::string random_bytes(std::size_t size, std::mt19937& random) {
  std::string bytes(size, '\0');
  for (char& c : bytes) c = static_cast<char>(random());
  return bytes;
}

/// read_request() says what parse_request() does; the positions count as part of the message.
void expect_same(std::string_view bytes, std::size_t piece) {
  ParseRoom room(32 << 20);
  grpc::ByteBuffer one = in_pieces(bytes, piece), other = in_pieces(bytes, piece);
  const Outcome<StreamRequest> read = read_request(one, room);
  const Outcome<v1::StreamStepsRequest> parsed = parse_request(other);
  ASSERT_EQ(read.ok(), parsed.ok());
  if (!read) {
    EXPECT_EQ(read.fault().message, parsed.fault().message);
    return;
  }
  v1::StreamStepsRequest whole = read.value().message;
  if (whole.has_step()) *whole.mutable_step() = read.value().whole_step();
  EXPECT_EQ(whole.SerializeAsString(), parsed.value().SerializeAsString());
}

TEST(PositionsMessageTest, IsTheMessageThatTheGeneralSerializerMakes) {
  std::mt19937 random(3);
  const auto positions = std::make_shared<const std::string>(random_bytes(3000, random));
  for (const std::uint64_t frame :
       {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{300}, ~std::uint64_t{0}}) {
    for (const std::size_t count : {0u, 1u, 127u, 128u, 2000u}) {
      for (const bool more : {false, true}) {
        v1::StreamStepsRequest parsed;
        ASSERT_TRUE(parsed.ParseFromString(
            flat(client::positions_message(frame, more, client::FrameBytes(positions), 1000, count))));
        EXPECT_EQ(parsed.step().frame(), frame);
        EXPECT_EQ(parsed.step().more(), more);
        EXPECT_EQ(parsed.step().positions(), positions->substr(1000, count));
        EXPECT_EQ(parsed.step().ByteSizeLong() > 0, count > 0 || frame > 0 || more);
      }
    }
  }
}

TEST(PositionsMessageTest, RefersToTheStringAndHoldsOnToIt) {
  auto positions = std::make_shared<const std::string>(5000, 'p');
  const char* const data = positions->data();
  const std::weak_ptr<const std::string> watched = positions;
  {
    const grpc::ByteBuffer buffer =
        client::positions_message(7, false, client::FrameBytes(positions), 0, 5000);
    positions.reset();
    EXPECT_FALSE(watched.expired());
    std::vector<grpc::Slice> slices;
    ASSERT_TRUE(buffer.Dump(&slices).ok());
    EXPECT_EQ(reinterpret_cast<const char*>(slices.back().begin()), data);
  }
  EXPECT_TRUE(watched.expired());
}

TEST(ReadRequestTest, LeavesAStepsPositionsWhereTheyArrived) {
  const auto positions = std::make_shared<const std::string>(1000, 'p');
  grpc::ByteBuffer buffer =
      in_pieces(flat(client::positions_message(9, true, client::FrameBytes(positions), 0, 1000)), 64);
  ParseRoom room(32 << 20);
  const Outcome<StreamRequest> request = read_request(buffer, room);
  ASSERT_TRUE(request.ok());
  EXPECT_TRUE(request.value().message.step().positions().empty());
  EXPECT_GT(request.value().positions.size(), 10u);
  EXPECT_EQ(request.value().whole_step().positions(), *positions);
  EXPECT_EQ(request.value().whole_step().frame(), 9u);
  EXPECT_TRUE(request.value().whole_step().more());
}

/// With places in shared memory.
v1::StreamStepsRequest shared_step() {
  v1::StreamStepsRequest request;
  v1::StepFrame& step = *request.mutable_step();
  step.set_frame(300);
  step.mutable_question()->set_kind(v1::Question::KIND_TRIAL);
  step.mutable_shared_positions()->set_offset(1 << 20);
  step.mutable_shared_positions()->set_length(556'116);
  step.mutable_answer_room()->set_length(1 << 16);
  return request;
}

TEST(ReadRequestTest, IsParseRequestForEveryKindOfMessageCutAnywhere) {
  std::mt19937 random(5);
  std::vector<std::string> messages;
  v1::StreamStepsRequest request;
  request.mutable_attach()->set_takeover(true);
  messages.push_back(request.SerializeAsString());
  request.mutable_detach();
  messages.push_back(request.SerializeAsString());
  request.mutable_step();
  messages.push_back(request.SerializeAsString());
  request.mutable_step()->set_frame(300);
  request.mutable_step()->set_positions(random_bytes(200, random));
  const std::string step = request.SerializeAsString();
  messages.push_back(step);
  request.mutable_step()->mutable_moved()->set_vertices(random_bytes(8, random));
  messages.push_back(request.SerializeAsString());
  messages.push_back(step + step);                        // merged: the last positions count
  messages.push_back(step + std::string("\x12\x00", 2));  // an attach after it: that counts
  messages.push_back(step + std::string("\x78\x01", 2));  // a field unknown here
  const std::string shared = shared_step().SerializeAsString();
  messages.push_back(shared);
  messages.push_back(shared + step);
  v1::StepFrame frame = request.step();
  frame.clear_moved();
  *frame.mutable_answer_room() = shared_step().step().answer_room();
  std::string twice = frame.SerializeAsString() + frame.SerializeAsString();
  messages.push_back(std::string("\x0a") + static_cast<char>(0x80 | (twice.size() & 0x7f)) +
                     static_cast<char>(twice.size() >> 7) + twice);
  for (const std::string& message : messages) {
    for (std::size_t piece = 1; piece <= message.size() + 1; piece += 1 + piece / 8)
      expect_same(message, piece);
    for (std::size_t size = 0; size < message.size(); ++size) expect_same(message.substr(0, size), 7);
  }
}

TEST(ReadRequestTest, IsParseRequestForMessagesThatWereDamaged) {
  std::mt19937 random(11);
  v1::StreamStepsRequest request;
  request.mutable_step()->set_frame(70'000);
  request.mutable_step()->set_positions(random_bytes(150, random));
  request.mutable_step()->set_more(true);
  const std::array sound{request.SerializeAsString(), shared_step().SerializeAsString()};
  for (std::size_t i = 0; i < 20'000; ++i) {
    std::string bytes = sound[i % 2];
    for (unsigned k = 0; k <= random() % 3; ++k) bytes[random() % 16] = static_cast<char>(random());
    if (random() % 4 == 0) bytes.resize(random() % bytes.size());
    expect_same(bytes, 1 + random() % 64);
  }
}

TEST(PositionBufferTest, PiecesTogetherAreTheSameAsOneByOne) {
  std::mt19937 random(13);
  const std::string bytes = random_bytes(3 * 8 * 20, random);
  PositionBuffer whole(Dtype::kFloat64, 20);
  ASSERT_TRUE(whole.append(bytes).ok());
  for (std::size_t piece = 1; piece < bytes.size(); piece += 3) {
    std::vector<std::string_view> pieces;
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      pieces.push_back(std::string_view(bytes).substr(at, piece));
    PositionBuffer buffer(Dtype::kFloat64, 20);
    const std::span<const std::string_view> all(pieces);
    ASSERT_TRUE(buffer.append(all.first(all.size() / 2)).ok());
    ASSERT_TRUE(buffer.append(all.subspan(all.size() / 2)).ok());
    ASSERT_TRUE(buffer.complete().ok());
    EXPECT_TRUE(buffer == whole);
    EXPECT_FALSE(buffer.append(all.first(1)).ok()) << "it is full";
  }
}

// In a small scene that takes more bytes than all positions; in this process such a frame is a frame too.
TEST(FrameBufferTest, EachVertexNamedOnceIsUnderstoodAndNoMoreIs) {
  const test::MovingGrids grids(2);
  const auto scene = Scene::create(grids.scene());
  ASSERT_TRUE(scene);
  const std::uint32_t count = scene.value().vertex_count();
  std::vector<std::uint32_t> each(count);
  std::iota(each.begin(), each.end(), 0U);
  const std::vector<double> positions = grids.positions(1);
  const std::string_view vertices(reinterpret_cast<const char*>(each.data()), 4 * each.size());
  const std::string_view rows(reinterpret_cast<const char*>(positions.data()), 8 * positions.size());
  server::FrameBuffer buffer(server::Dtype::kFloat64, scene.value());
  EXPECT_TRUE(buffer.append({.vertices = vertices, .vertex_positions = rows}).ok());
  ASSERT_TRUE(buffer.complete(scene.value()).ok());
  EXPECT_EQ(buffer.view().vertices.size(), count);
  EXPECT_LE(buffer.bytes(), buffer.expected_bytes());
  EXPECT_FALSE(buffer.append({.vertices = "once more"}).ok());
}

TEST(SceneStateTest, LaterRequestsDoNotWriteToAFramesPositions) {
  SceneDescription scene;
  scene.vertex_count = 3;
  scene.faces = {{0, 1, 2}};
  const std::vector<double> start{0, 0, 0, 1, 0, 0, 0, 1, 0}, next{0, 0, 1, 1, 0, 1, 0, 1, 1}, row{5, 6, 7};
  client::SceneState state(scene, std::span<const double>(start));
  const client::SentFrame all = state.encode(Frame(std::span<const double>(next))).value();
  const std::string bytes(all.positions.view());
  state.take(all);
  EXPECT_EQ(state.positions(), bytes);
  Frame moved;
  const std::vector<std::uint32_t> vertices{2};
  moved.vertices = vertices;
  moved.vertex_positions = std::span<const double>(row);
  state.take(state.encode(moved).value());
  EXPECT_EQ(all.positions.view(), bytes) << "gRPC may be sending it still";
  EXPECT_EQ(state.positions().substr(0, 48), bytes.substr(0, 48));
  EXPECT_EQ(std::memcmp(state.positions().data() + 48, row.data(), 24), 0);
}

}  // namespace
}  // namespace warmfront::server
