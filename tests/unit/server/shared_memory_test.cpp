// SPDX-License-Identifier: Apache-2.0
// Memory that a client shares with the daemon, by a client without our library that does as it is told, and
// by one that does what it likes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <limits>
#include <random>
#include <thread>

#include "tests/unit/server/packet_client.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kBytes = std::uint64_t{1} << 20;
constexpr std::uint64_t kRoomAt = std::uint64_t{1} << 19;

/// A stream of the session, attached.
struct Attached {
  Attached(v1::CollisionService::Stub& stub, const std::string& id) : stream(stub.StreamSteps(&context)) {
    stream->Write(attach(id));
    v1::StreamStepsResponse response;
    EXPECT_TRUE(stream->Read(&response));
    token = response.attached().shared_memory().token();
    state = response.attached();
  }
  static v1::StreamStepsRequest attach(const std::string& id) {
    v1::StreamStepsRequest request;
    request.mutable_attach()->set_session_id(id);
    request.mutable_attach()->set_takeover(true);
    return request;
  }

  Context context;
  std::unique_ptr<Stream> stream;
  std::string token;
  v1::Attached state;
};

class SharedMemoryTest : public ServiceTest {
 protected:
  using ServiceTest::ServiceTest;

  static v1::StreamStepsRequest shared_frame(std::uint64_t number, std::uint64_t offset,
                                             std::uint64_t length) {
    v1::StreamStepsRequest request;
    v1::StepFrame& step = *request.mutable_step();
    step.set_frame(number);
    step.mutable_shared_positions()->set_offset(offset);
    step.mutable_shared_positions()->set_length(length);
    return request;
  }
  /// The positions of the frame, from `offset` on, and where its answer may be.
  v1::StreamStepsRequest put(const PacketClient& packets, std::uint64_t number,
                             std::uint64_t offset = 0) const {
    const std::string positions = frame(number);
    std::memcpy(packets.memory() + offset, positions.data(), positions.size());
    v1::StreamStepsRequest request = shared_frame(number, offset, positions.size());
    request.mutable_step()->mutable_answer_room()->set_offset(kRoomAt);
    request.mutable_step()->mutable_answer_room()->set_length(kBytes - kRoomAt);
    return request;
  }
  /// The hash of an answer, wherever its columns are.
  static std::uint64_t hash_in(const PacketClient& packets, const v1::StepAnswer& answer) {
    if (!answer.has_shared()) return hash_of(answer.contacts());
    v1::ContactColumns columns;
    std::uint64_t at = answer.shared().offset();
    const auto column = [&](wire::SharedColumn which, std::size_t size) {
      if ((answer.shared().columns() & wire::bit_of(which)) == 0) return std::string();
      at = wire::column_begins(at);
      std::string bytes(packets.memory() + at, size * answer.summary().rows());
      at += bytes.size();
      return bytes;
    };
    columns.set_kind(column(wire::SharedColumn::kKind, 1));
    columns.set_status(column(wire::SharedColumn::kStatus, 1));
    columns.set_v(column(wire::SharedColumn::kVertices, 16));
    columns.set_toi(column(wire::SharedColumn::kToi, 8));
    return hash_of(columns);
  }
  void expect_refused(PacketClient& packets, const v1::StreamStepsRequest& request, const char* words) {
    ASSERT_TRUE(packets.send(request));
    const auto response = packets.receive();
    ASSERT_TRUE(response);
    EXPECT_EQ(response->error().status().code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(response->error().status().message(), HasSubstr(words));
  }
  std::uint64_t charged() {
    Context context;
    v1::GetServerInfoResponse info;
    EXPECT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
    return info.charged_bytes();
  }
  std::uint64_t held() { return session_info().memory_bytes(); }

  const std::vector<std::uint64_t> expected_ = local_hashes(grids_, 0, 8);
};

TEST_F(SharedMemoryTest, CarriesTheSameBits) {
  ASSERT_TRUE(create().ok());
  Attached attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
  EXPECT_GE(packets.size(), kBytes);
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

TEST_F(SharedMemoryTest, NobodyChangesItsSize) {
  ASSERT_TRUE(create().ok());
  Attached attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
  EXPECT_NE(::ftruncate(packets.file(), 0), 0);
  EXPECT_NE(::ftruncate(packets.file(), 2 * static_cast<off_t>(packets.size())), 0);
  ASSERT_TRUE(packets.send(put(packets, 1)));
  EXPECT_TRUE(packets.receive()->has_answer());
}

TEST_F(SharedMemoryTest, AnswersWithoutRoomComeInTheMessage) {
  ASSERT_TRUE(create().ok());
  Attached attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
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
  Attached attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
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
  Attached attached(*stub_, kId);
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
  Attached mine(*stub_, kId);
  Attached other(*stub_, kOther);
  EXPECT_NE(mine.token, other.token);
  EXPECT_EQ(mine.token.size(), 16U);
  for (const std::string& token : {std::string(), std::string(16, 'x'), std::string(900, 'x')})
    EXPECT_FALSE(PacketClient(daemon_.address()).bind(kId, token, kBytes));
  EXPECT_FALSE(PacketClient(daemon_.address()).bind(kOther, mine.token, kBytes)) << "of another session";
  EXPECT_FALSE(PacketClient(daemon_.address()).bind(kId, mine.token, kBytes)) << "it was used";
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kOther, other.token, kBytes));
  EXPECT_FALSE(PacketClient(daemon_.address()).bind(kOther, other.token, kBytes)) << "it was used";
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
    Attached attached(*stub_, kId);
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
  Attached attached(*stub_, kId);
  {
    PacketClient packets(daemon_.address());
    ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
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
  Attached attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
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
    Attached attached(*stub_, kId);
    PacketClient packets(daemon_.address());
    ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
    ASSERT_TRUE(packets.send(garbage));
    EXPECT_TRUE(packets.ended());
    v1::StreamStepsResponse response;
    EXPECT_FALSE(attached.stream->Read(&response));
    EXPECT_EQ(attached.stream->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
  expect_healthy();
}

// Whatever is in the memory when, a frame is answered as what it was copied as, or refused.
TEST_F(SharedMemoryTest, WhoScribblesHarmsNobodyElse) {
  ASSERT_TRUE(create().ok());
  Attached attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
  std::jthread scribbler([&](std::stop_token stop) {  // ends with the test, however that ends
    std::mt19937_64 random(7);
    auto* words = reinterpret_cast<std::uint64_t*>(packets.memory());
    while (!stop.stop_requested()) {
      const std::uint64_t at = random() % (packets.size() / 8);
      std::atomic_ref<std::uint64_t>(words[at]).store(random(), std::memory_order_relaxed);
    }
  });
  std::uint64_t next = 1;
  int refused = 0;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(packets.send(put(packets, next)));
    auto response = packets.receive();
    ASSERT_TRUE(response);
    // What is in the memory may meet itself in more places than there is room for.
    while (response->has_on_stream() || (response->has_answer() && !response->answer().last())) {
      if (response->has_on_stream())
        ASSERT_TRUE(attached.stream->Read(&*response));
      else
        ASSERT_TRUE((response = packets.receive()));
    }
    if (response->has_answer()) {
      EXPECT_EQ(response->answer().frame(), next);
      EXPECT_EQ(response->answer().summary().state().frame(), next);
      ++next;
    } else {
      EXPECT_EQ(response->error().status().code(), grpc::StatusCode::INVALID_ARGUMENT)
          << response->error().status().message();
      ++refused;
    }
  }
  scribbler.request_stop();
  scribbler.join();
  EXPECT_GT(next, 1U);
  expect_healthy();
}

TEST_F(SharedMemoryTest, RandomPacketsHarmNobodyElse) {
  ASSERT_TRUE(create().ok());
  std::mt19937_64 random(11);
  for (int round = 0; round < 40; ++round) {
    Attached attached(*stub_, kId);
    ASSERT_FALSE(attached.token.empty());
    PacketClient packets(daemon_.address());
    ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
    for (int i = 0; i < 20; ++i) {
      std::string packet = random() % 2 == 0
                               ? put(packets, attached.state.expected_frame()).SerializeAsString()
                               : frame_message(random() % 9, frame(2)).SerializeAsString();
      for (std::uint64_t changes = random() % 3; changes > 0; --changes)
        packet[random() % packet.size()] = static_cast<char>(random());
      if (!packets.send(packet)) break;
    }
    packets.close();
    attached.context.TryCancel();
  }
  expect_healthy();
}

// Most of them say nothing at all.
TEST_F(SharedMemoryTest, StrangersAreBounded) {
  ASSERT_TRUE(create().ok());
  std::vector<std::unique_ptr<PacketClient>> silent;
  for (int i = 0; i < 100; ++i) silent.push_back(std::make_unique<PacketClient>(daemon_.address()));
  expect_healthy();
  EXPECT_TRUE(silent.back()->ended()) << "one more than there may be";
  EXPECT_TRUE(silent.front()->ended()) << "it was silent for too long";
  Attached attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kBytes));
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
  const Attached attached(*stub_, kId);
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
  Attached attached(*stub_, kId);
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
  Attached first(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, first.token, kBytes));
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
