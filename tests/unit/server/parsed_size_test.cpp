// SPDX-License-Identifier: Apache-2.0
// The memory that a message takes once parsed, bounded beforehand: no less than the allocator measures
// afterwards, and little enough for ordinary messages to pass.
#include "server/transport/parsed_size.h"

#include <gmock/gmock.h>
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <chrono>
#include <random>
#include <thread>

#include "server/transport/parse_room.h"
#include "server/transport/stream_codec.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::server {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kMiB = std::size_t{1} << 20;

grpc::ByteBuffer in_pieces(std::string_view bytes, std::size_t piece) {
  std::vector<grpc::Slice> slices;
  for (std::size_t at = 0; at < bytes.size(); at += piece)
    slices.emplace_back(bytes.data() + at, std::min(piece, bytes.size() - at));
  return {slices.data(), slices.size()};
}

grpc::ByteBuffer buffer_of(std::string_view bytes) {
  return in_pieces(bytes, 16384);
}

template <class Message>
std::size_t told(std::string_view bytes, std::size_t enough = std::size_t{1} << 40) {
  return parsed_size(buffer_of(bytes), MessageLayout::of(*Message::descriptor()), enough);
}

std::string repeated(std::string_view bytes, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += bytes;
  return all;
}

/// A field of that number that holds these bytes.
std::string field(int number, const std::string& bytes) {
  std::string all(1, static_cast<char>(number << 3 | 2));
  std::size_t length = bytes.size();
  for (; length >= 128; length >>= 7) all += static_cast<char>(128 | (length & 127));
  return all + static_cast<char>(length) + bytes;
}

/// What the allocator has handed out in this thread's arena and the main one, and in blocks of their own.
std::size_t allocated() {
  const struct mallinfo2 all = mallinfo2();
  return all.uordblks + all.hblkhd;
}

/// The bound, and the measured size.
template <class Message>
void expect_enough(const std::string& bytes, const char* what) {
  const std::size_t before = allocated();
  auto message = std::make_unique<Message>();
  static_cast<void>(message->ParseFromString(bytes));
  const std::size_t is = allocated() - before;
  const std::size_t said = told<Message>(bytes);
  EXPECT_GE(said, message->SpaceUsedLong()) << what;
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_GE(said, is) << what;
#endif
  std::printf("%s: %zu bytes become %zu, told as %zu\n", what, bytes.size(), is, said);
}

v1::SessionHeader header_of_bodies(std::uint32_t count, const std::string& name) {
  v1::SessionHeader header;
  for (std::uint32_t i = 0; i < count; ++i) {
    v1::Body& body = *header.add_bodies();
    body.set_name(name);
    body.set_first_vertex(100 * i);
    body.set_vertex_count(100);
    body.set_kind(v1::BODY_KIND_RIGID);
  }
  return header;
}

TEST(ParsedSizeTest, IsNoLessThanWhatTheAllocatorHandsOut) {
  constexpr std::size_t kMany = 50'000;
  const std::string empty_body("\x32\x00", 2), empty_pair("\x42\x00", 2), empty_change("\x1a\x00", 2);
  const std::string unknown_number("\xf8\x07\x01", 3), unknown_string("\xfa\x07\x01x", 4);
  const std::string unknown_group("\xfb\x07\xfc\x07", 4);
  expect_enough<v1::SessionHeader>(repeated(empty_body, kMany), "empty bodies");
  expect_enough<v1::SessionHeader>(repeated(empty_pair, kMany), "empty pairs");
  expect_enough<v1::ChangeSceneRequest>(repeated(empty_change, kMany), "empty changes");
  expect_enough<v1::ChangeSceneRequest>(repeated(field(3, field(1, field(1, unknown_number))), kMany),
                                        "additions of nothing");
  expect_enough<v1::ChangeSceneRequest>(repeated(field(3, field(3, "")), kMany), "changes to no filters");
  expect_enough<v1::ChangeSceneRequest>(repeated(field(3, field(3, field(3, "x") + field(5, "y"))), kMany),
                                        "filters of short arrays");
  expect_enough<v1::CreateSessionRequest>(field(4, std::string(2 * kMiB, 'r')), "a part of a rest shape");
  expect_enough<v1::SessionHeader>(repeated(unknown_number, kMany), "unknown numbers");
  expect_enough<v1::SessionHeader>(repeated(unknown_string, kMany), "unknown strings");
  expect_enough<v1::SessionHeader>(repeated(unknown_group, kMany), "unknown groups");
  expect_enough<v1::GetSessionRequest>(field(1, std::string(5 * kMiB, 'i')), "a long id");
  expect_enough<v1::CreateSessionRequest>(field(1, repeated(empty_body, kMany)), "a header in a part");
  expect_enough<v1::CreateSessionRequest>(field(1, repeated(empty_body, kMany)) + "\x07",
                                          "and no message at all");
  expect_enough<v1::SessionHeader>(header_of_bodies(kMany, "wheel, front left").SerializeAsString(),
                                   "bodies");
  expect_enough<v1::SessionHeader>(header_of_bodies(kMany, "").SerializeAsString(), "bodies without names");
}

TEST(ParsedSizeTest, TheBoundHoldsForAnyBytesInAnySegmentation) {
  google::protobuf::SetLogHandler(nullptr);
  std::mt19937 random(5);
  v1::ChangeSceneRequest request;
  request.set_session_id("id");
  *request.add_changes()->mutable_add()->mutable_body() = header_of_bodies(1, "name").bodies(0);
  request.mutable_changes(0)->mutable_add()->set_faces(std::string(300, 'f'));
  request.add_changes()->mutable_change()->set_index(7);
  const std::string whole = request.SerializeAsString();
  for (int round = 0; round < 3000; ++round) {
    std::string bytes = whole;
    for (int flips = round % 4; flips > 0; --flips)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    bytes.resize(bytes.size() - (round % 3 == 0 ? random() % bytes.size() : 0));
    v1::ChangeSceneRequest message;
    static_cast<void>(message.ParseFromString(bytes));
    const std::size_t said = told<v1::ChangeSceneRequest>(bytes);
    EXPECT_GE(said, message.SpaceUsedLong());
    const MessageLayout& layout = MessageLayout::of(*v1::ChangeSceneRequest::descriptor());
    EXPECT_EQ(said, parsed_size(in_pieces(bytes, 1 + random() % 7), layout, std::size_t{1} << 40));
    EXPECT_LE(said, layout.most(bytes.size())) << "the bound for any content of that length";
  }
}

TEST(ParsedSizeTest, NestingIsFollowedAsDeepAsTheParserGoes) {
  std::string groups = repeated("\xfb\x07", 100'000);
  v1::SessionHeader header;
  EXPECT_FALSE(header.ParseFromString(groups));
  EXPECT_GE(told<v1::SessionHeader>(groups), header.SpaceUsedLong());
}

TEST(ParsedSizeTest, CountsNoFurtherThanNeeded) {
  const std::string bytes = repeated(std::string("\x32\x00", 2), 1'000'000);
  EXPECT_GT(told<v1::SessionHeader>(bytes), 64 * kMiB);
  EXPECT_GT(told<v1::SessionHeader>(bytes, kMiB), kMiB);
}

TEST(ParseRoomTest, HonestMessagesPass) {
  ParseRoom room(32 * kMiB);
  const auto passes = [&](const auto& message, const char* what) {
    const std::string bytes = message.SerializeAsString();
    ASSERT_LE(bytes.size(), 32 * kMiB) << what;
    const grpc::ByteBuffer buffer = buffer_of(bytes);
    const MessageLayout& layout = MessageLayout::of(*message.GetDescriptor());
    const auto start = std::chrono::steady_clock::now();
    const auto place = room.enter(buffer, layout, what);
    const auto took = std::chrono::steady_clock::now() - start;
    EXPECT_TRUE(place.ok()) << what << ": " << (place ? "" : place.fault().message);
    std::printf("%s: %zu bytes, %zu charged, looked at in %lld us\n", what, bytes.size(), room.used(),
                static_cast<long long>(std::chrono::duration_cast<std::chrono::microseconds>(took).count()));
  };
  passes(header_of_bodies(1'500'000, ""), "a header of bodies without names");
  passes(header_of_bodies(500'000, "wheel, front left, of the car in the middle"), "a header of bodies");
  v1::SessionHeader pairs;
  for (std::uint32_t i = 0; i < 2'000'000; ++i) {
    v1::BodyPair& pair = *pairs.add_excluded_pairs();
    pair.set_a(i % 100'000);
    pair.set_b(i);
  }
  passes(pairs, "excluded pairs");
  v1::ChangeSceneRequest change;
  v1::BodyAddition& add = *change.add_changes()->mutable_add();
  add.set_faces(std::string(15 * kMiB, 'f'));
  add.set_positions(std::string(15 * kMiB, 'p'));
  passes(change, "a body of a large mesh");
  v1::StepRequest step;
  step.set_positions(std::string(31 * kMiB, 'p'));
  passes(step, "a step");
  v1::StreamStepsRequest posed;
  posed.mutable_step()->mutable_moved()->set_pose_bodies(std::string(400'000, 'b'));
  posed.mutable_step()->mutable_moved()->set_poses(std::string(9'600'000, 'p'));
  passes(posed, "poses of 100,000 bodies");
  EXPECT_EQ(room.used(), 0u);
}

TEST(ParseRoomTest, MessagesThatWouldGrowTooLargeAreRefusedAndReadsAreBounded) {
  ParseRoom room(kMiB);
  const MessageLayout& layout = MessageLayout::of(*v1::SessionHeader::descriptor());
  const auto refused = room.enter(buffer_of(repeated(std::string("\x32\x00", 2), 500'000)), layout, "Test");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.fault().code, ErrorCode::kResourceExhausted);
  EXPECT_STREQ(refused.fault().limit, "max-message-bytes");
  EXPECT_FALSE(refused.fault().retry_after) << "it would be refused again";
  EXPECT_THAT(refused.fault().message,
              HasSubstr("Test: a message of 976.6 KiB would become more than 9.0 MiB"));

  const std::string half = field(1, std::string(5 * kMiB, 'i'));
  std::optional<ParseRoom::Place> first;
  {
    auto place = room.enter(buffer_of(half), layout, "Test");
    ASSERT_TRUE(place.ok());
    first.emplace(std::move(place).value());
  }
  const auto second = room.enter(buffer_of(half), layout, "Test");
  ASSERT_FALSE(second.ok()) << "the first is not done";
  EXPECT_EQ(second.fault().code, ErrorCode::kResourceExhausted);
  EXPECT_TRUE(second.fault().retry_after);
  std::thread done([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    first.reset();
  });
  EXPECT_TRUE(room.enter(buffer_of(half), layout, "Test").ok()) << "a waiting client is let in";
  done.join();
  EXPECT_EQ(room.used(), 0u);
}

}  // namespace
}  // namespace warmfront::server
