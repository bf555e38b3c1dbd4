// SPDX-License-Identifier: Apache-2.0
// Memory that a client shares with the daemon, by a client without our library that does as it is told.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <limits>
#include <thread>

#include "tests/unit/server/packet_client.h"
#include "tests/unit/server/service_fixture.h"
#include "tests/unit/server/shared_memory_fixture.h"

namespace warmfront::test {
namespace {

TEST_F(SharedMemoryTest, CarriesTheSameBits) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
  EXPECT_GE(packets.size(), kSharedBytes);
  for (std::uint64_t number = 1; number <= 8; ++number) {
    ASSERT_TRUE(packets.send(put(packets, number, number % 2 * 100'000)));
    const auto response = packets.receive();
    ASSERT_TRUE(response && response->has_answer());
    EXPECT_EQ(response->answer().frame(), number);
    EXPECT_TRUE(response->answer().last());
    EXPECT_TRUE(response->answer().has_shared());
    EXPECT_EQ(hash_in(packets, response->answer()), expected_[number - 1]);
  }
  ASSERT_TRUE(packets.send(detach()));
  EXPECT_TRUE(packets.ended());
  EXPECT_TRUE(attached.stream->Finish().ok());
}

TEST_F(SharedMemoryTest, AFrameMayBeginBeforeItsPositionsAreWritten) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  EXPECT_TRUE(attached.state.shared_memory().early_frames());
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
  for (std::uint64_t number = 1; number <= 4; ++number) {
    v1::StreamStepsRequest first;
    first.mutable_step()->set_frame(number);
    first.mutable_step()->set_more(true);
    // With what is asked, as many first messages as one likes, and time for the daemon to fall asleep.
    first.mutable_step()->mutable_question()->set_kind(v1::Question::KIND_STEP);
    ASSERT_TRUE(packets.send(first));
    first.mutable_step()->clear_question();
    ASSERT_TRUE(packets.send(first));
    if (number == 2) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ASSERT_TRUE(packets.send(put(packets, number)));
    const auto response = packets.receive();
    ASSERT_TRUE(response && response->has_answer());
    EXPECT_TRUE(response->answer().has_shared());
    EXPECT_EQ(hash_in(packets, response->answer()), expected_[number - 1]);
  }
}

TEST_F(SharedMemoryTest, PositionsThereAreAllThatAFrameHas) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
  v1::StreamStepsRequest part;
  part.mutable_step()->set_frame(1);
  part.mutable_step()->set_more(true);
  for (const bool moved : {false, true}) {
    if (moved)
      part.mutable_step()->mutable_moved();
    else
      part.mutable_step()->set_positions(frame(1).substr(0, 24));
    ASSERT_TRUE(packets.send(part));
    part.mutable_step()->clear_positions();
    expect_refused(packets, put(packets, 1), "give either");
  }
  v1::StreamStepsRequest early = put(packets, 1);
  early.mutable_step()->set_more(true);
  ASSERT_TRUE(packets.send(early));
  expect_refused(packets, put(packets, 1), "a frame's last message");
  ASSERT_TRUE(packets.send(put(packets, 1)));
  EXPECT_EQ(hash_in(packets, packets.receive()->answer()), expected_[0]);
}

TEST_F(SharedMemoryTest, NobodyChangesItsSize) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
  EXPECT_NE(::ftruncate(packets.file(), 0), 0);
  EXPECT_NE(::ftruncate(packets.file(), 2 * static_cast<off_t>(packets.size())), 0);
  ASSERT_TRUE(packets.send(put(packets, 1)));
  EXPECT_TRUE(packets.receive()->has_answer());
}

TEST_F(SharedMemoryTest, AnswersWithoutRoomComeInTheMessage) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
  for (const std::uint64_t room : {0U, 1U, 64U}) {
    const std::uint64_t number = room == 0 ? 1 : room == 1 ? 2 : 3;
    v1::StreamStepsRequest request = put(packets, number);
    request.mutable_step()->mutable_answer_room()->set_length(room);
    ASSERT_TRUE(packets.send(request));
    const auto response = packets.receive();
    ASSERT_TRUE(response && response->has_answer());
    EXPECT_GT(response->answer().summary().rows(), 2U);
    EXPECT_FALSE(response->answer().has_shared());
    EXPECT_EQ(hash_in(packets, response->answer()), expected_[number - 1]);
  }
}

TEST_F(SharedMemoryTest, BytesBeyondItAreRefusedInTheirTurn) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
  const std::uint64_t size = packets.size();
  const std::uint64_t length = frame(1).size();
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  for (const auto& [offset, bytes] :
       std::vector<std::pair<std::uint64_t, std::uint64_t>>{{size, length},
                                                            {size - length + 1, length},
                                                            {kMost, length},
                                                            {kMost - length + 1, length},
                                                            {0, kMost},
                                                            {1, kMost},
                                                            {size, 1},
                                                            {size + 1, 0}}) {
    SCOPED_TRACE(std::to_string(offset) + ", " + std::to_string(bytes));
    expect_refused(packets, shared_frame(1, offset, bytes), "shared_positions");
    v1::StreamStepsRequest request = put(packets, 1);
    request.mutable_step()->mutable_answer_room()->set_offset(offset);
    request.mutable_step()->mutable_answer_room()->set_length(bytes);
    expect_refused(packets, request, "answer_room");
  }
  // Within, and not what the scene needs.
  expect_refused(packets, shared_frame(1, 0, length - 8), "positions");
  expect_refused(packets, shared_frame(1, 0, size), "positions");
  expect_refused(packets, shared_frame(1, 0, 0), "positions");
  v1::StreamStepsRequest both = put(packets, 1);
  both.mutable_step()->set_positions(frame(1));
  expect_refused(packets, both, "give either");
  both.mutable_step()->clear_positions();
  both.mutable_step()->mutable_moved();
  expect_refused(packets, both, "give either");
  ASSERT_TRUE(packets.send(put(packets, 1)));
  EXPECT_EQ(hash_in(packets, packets.receive()->answer()), expected_[0]);
}

TEST_F(SharedMemoryTest, AStreamWithoutItRefusesFramesThatNameIt) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  attached.stream->Write(shared_frame(1, 0, frame(1).size()));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(attached.stream->Read(&response));
  EXPECT_EQ(response.error().status().code(), grpc::StatusCode::INVALID_ARGUMENT);
  attached.stream->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(attached.stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected_[0]);
  v1::StreamStepsRequest request;
  request.mutable_on_stream();
  attached.stream->Write(request);
  EXPECT_FALSE(attached.stream->Read(&response));
  EXPECT_EQ(attached.stream->Finish().error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(SharedMemoryTest, ATokenIsOfOneStreamAndForOnce) {
  ASSERT_TRUE(create().ok());
  ASSERT_TRUE(create(kOther).ok());
  AttachedStream mine(*stub_, kId);
  AttachedStream other(*stub_, kOther);
  EXPECT_NE(mine.token, other.token);
  EXPECT_EQ(mine.token.size(), 16U);
  for (const std::string& token : {std::string(), std::string(16, 'x'), std::string(900, 'x')})
    EXPECT_FALSE(PacketClient(daemon_.address()).bind(kId, token, kSharedBytes));
  EXPECT_FALSE(PacketClient(daemon_.address()).bind(kOther, mine.token, kSharedBytes))
      << "of another session";
  EXPECT_FALSE(PacketClient(daemon_.address()).bind(kId, mine.token, kSharedBytes)) << "it was used";
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kOther, other.token, kSharedBytes));
  EXPECT_FALSE(PacketClient(daemon_.address()).bind(kOther, other.token, kSharedBytes)) << "it was used";
  ASSERT_TRUE(packets.send(put(packets, 1)));
  EXPECT_EQ(hash_in(packets, packets.receive()->answer()), expected_[0]);
  // The stream whose token was spent goes on without.
  mine.stream->Write(frame_message(1, frame(1)));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(mine.stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected_[0]);
}

TEST_F(SharedMemoryTest, IsChargedToTheSessionAndGivenBack) {
  ASSERT_TRUE(create().ok());
  constexpr std::uint64_t kMuch = std::uint64_t{64} << 20;
  const std::uint64_t before = held();
  {
    AttachedStream attached(*stub_, kId);
    PacketClient packets(daemon_.address());
    ASSERT_TRUE(packets.bind(kId, attached.token, kMuch));
    EXPECT_GE(charged(), kMuch);
    static_cast<void>(packets.bind(kId, "", std::uint64_t{1} << 50));
    EXPECT_EQ(packets.error().code(), grpc::StatusCode::INVALID_ARGUMENT);
    ASSERT_TRUE(packets.send(put(packets, 1)));
    EXPECT_EQ(hash_in(packets, packets.receive()->answer()), expected_[0]) << "what there is stays";
    packets.send(detach());
    EXPECT_TRUE(packets.ended());
    EXPECT_TRUE(attached.stream->Finish().ok());
  }
  EXPECT_LT(charged(), kMuch);
  EXPECT_LE(held(), before + kMuch / 2);
}

TEST_F(SharedMemoryTest, AConnectionThatEndsLeavesTheStream) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  {
    PacketClient packets(daemon_.address());
    ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
    ASSERT_TRUE(packets.send(put(packets, 1)));
    ASSERT_TRUE(packets.receive());
  }
  attached.stream->Write(frame_message(2, frame(2)));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(attached.stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected_[1]);
  attached.stream->Write(detach());
  EXPECT_FALSE(attached.stream->Read(&response));
  EXPECT_TRUE(attached.stream->Finish().ok());
}

TEST_F(SharedMemoryTest, WhatIsTooLongForAPacketComesByTheStreamInOrder) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
  v1::StreamStepsRequest notice;
  notice.mutable_on_stream();
  // It may be there before it is announced.
  attached.stream->Write(frame_message(2, frame(2)));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_TRUE(packets.send(put(packets, 1)));
  EXPECT_EQ(hash_in(packets, packets.receive()->answer()), expected_[0]);
  ASSERT_TRUE(packets.send(notice));
  EXPECT_EQ(hash_in(packets, packets.receive()->answer()), expected_[1]);
  ASSERT_TRUE(packets.send(notice));
  attached.stream->Write(frame_message(3, frame(3)));
  EXPECT_EQ(hash_in(packets, packets.receive()->answer()), expected_[2]);
  // A packet that is too long ends the connection, and not the stream.
  ASSERT_TRUE(packets.send(std::string(wire::kMostPacketBytes + 1, 'x')));
  EXPECT_TRUE(packets.ended());
  attached.stream->Write(frame_message(4, frame(4)));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(attached.stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected_[3]);
}

TEST_F(SharedMemoryTest, BytesThatAreNoMessageEndTheStream) {
  ASSERT_TRUE(create().ok());
  for (const std::string& garbage :
       {std::string("\xff\xff\xff"), std::string(5000, '\x7f'), std::string("\x0a\x05")}) {
    AttachedStream attached(*stub_, kId);
    PacketClient packets(daemon_.address());
    ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
    ASSERT_TRUE(packets.send(garbage));
    EXPECT_TRUE(packets.ended());
    v1::StreamStepsResponse response;
    EXPECT_FALSE(attached.stream->Read(&response));
    EXPECT_EQ(attached.stream->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
  expect_healthy();
}

class NoSharedMemoryTest : public SharedMemoryTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.no_shared_memory = true;
    return config;
  }
  NoSharedMemoryTest() : SharedMemoryTest(config()) {}
};

TEST_F(NoSharedMemoryTest, IsNotOffered) {
  ASSERT_TRUE(create().ok());
  const AttachedStream attached(*stub_, kId);
  EXPECT_FALSE(attached.state.has_shared_memory());
  EXPECT_FALSE(PacketClient(daemon_.address()).connected());
  Context context;
  v1::GetServerInfoResponse info;
  ASSERT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
  EXPECT_EQ(std::ranges::count(info.features(), v1::FEATURE_SHARED_MEMORY), 0);
}

class LittleMemoryTest : public SharedMemoryTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_session_bytes = 16 << 20;
    return config;
  }
  LittleMemoryTest() : SharedMemoryTest(config()) {}
};

TEST_F(LittleMemoryTest, WhatTheSessionMayNotHoldIsRefusedAndTheStreamGoesOn) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  EXPECT_FALSE(packets.bind(kId, attached.token, std::uint64_t{64} << 20));
  EXPECT_EQ(packets.error().code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(packets.ended());
  attached.stream->Write(frame_message(1, frame(1)));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(attached.stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected_[0]);
}

// gRPC's end of the stream is the stream's: a client that dies, is cut off or taken over leaves no
// connection.
TEST_F(SharedMemoryTest, TheConnectionEndsWithItsStream) {
  ASSERT_TRUE(create().ok());
  AttachedStream first(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, first.token, kSharedBytes));
  Context context;
  const auto second = open(context, 1, kId, true);
  EXPECT_TRUE(packets.ended());
  EXPECT_EQ(first.stream->Finish().error_code(), grpc::StatusCode::ABORTED);
  Context more;
  const auto third = open(more, 1, kId, true);
  more.TryCancel();
  expect_healthy();
}

}  // namespace
}  // namespace warmfront::test
