// SPDX-License-Identifier: Apache-2.0
// A client of shared memory that does what it likes harms nobody else.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <random>
#include <thread>

#include "tests/unit/server/packet_client.h"
#include "tests/unit/server/shared_memory_fixture.h"

namespace warmfront::test {
namespace {

// Whatever is in the memory when, a frame is answered as what it was copied as, or refused.
TEST_F(SharedMemoryTest, WhoScribblesHarmsNobodyElse) {
  ASSERT_TRUE(create().ok());
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
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
  for (int i = 0; i < 80; ++i) {
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
    AttachedStream attached(*stub_, kId);
    ASSERT_FALSE(attached.token.empty());
    PacketClient packets(daemon_.address());
    ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
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
  AttachedStream attached(*stub_, kId);
  PacketClient packets(daemon_.address());
  ASSERT_TRUE(packets.bind(kId, attached.token, kSharedBytes));
}

}  // namespace
}  // namespace warmfront::test
