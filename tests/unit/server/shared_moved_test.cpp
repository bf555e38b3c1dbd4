// SPDX-License-Identifier: Apache-2.0
// What moved, in memory that a client shares with the daemon: by a client without our library.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <numeric>
#include <optional>
#include <random>
#include <thread>

#include "tests/unit/server/packet_client.h"
#include "tests/unit/server/shared_memory_fixture.h"

namespace warmfront::test {
namespace {

class SharedMovedTest : public SharedMemoryTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(create().ok());
    attached_.emplace(*stub_, kId);
    packets_.emplace(daemon_.address());
    ASSERT_TRUE(packets_->bind(kId, attached_->token, kSharedBytes));
  }
  static std::string bytes_of_all(std::uint32_t count) {
    std::vector<std::uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0U);
    return {reinterpret_cast<const char*>(all.data()), 4 * all.size()};
  }
  void write(std::uint64_t offset, const std::string& bytes, v1::SharedBytes& place) {
    std::memcpy(packets_->memory() + offset, bytes.data(), bytes.size());
    place.set_offset(offset);
    place.set_length(bytes.size());
  }
  /// The frame, which names each vertex.
  v1::StreamStepsRequest put_moved(std::uint64_t number) {
    v1::StreamStepsRequest request = put(*packets_, number);
    v1::StepFrame& step = *request.mutable_step();
    step.clear_shared_positions();
    write(1000, bytes_of_all(grids_.vertex_count()), *step.mutable_shared_moved()->mutable_vertices());
    write(10'001, frame(number), *step.mutable_shared_moved()->mutable_vertex_positions());
    return request;
  }
  void expect_answer(std::uint64_t number) {
    const auto response = packets_->receive();
    ASSERT_TRUE(response && response->has_answer());
    EXPECT_EQ(hash_in(*packets_, response->answer()), expected_[number - 1]);
  }
  void expect_refused(const v1::StreamStepsRequest& request, const char* words) {
    SharedMemoryTest::expect_refused(*packets_, request, words);
  }

  std::optional<AttachedStream> attached_;
  std::optional<PacketClient> packets_;
};

TEST_F(SharedMovedTest, IsAsIfItWereInTheMessage) {
  EXPECT_TRUE(attached_->state.shared_memory().moved());
  for (std::uint64_t number = 1; number <= 6; ++number) {
    ASSERT_TRUE(packets_->send(number % 3 == 0 ? put(*packets_, number) : put_moved(number)));
    expect_answer(number);
  }
}

TEST_F(SharedMovedTest, MayFollowWhatWasAskedFirst) {
  v1::StreamStepsRequest first;
  first.mutable_step()->set_frame(1);
  first.mutable_step()->set_more(true);
  ASSERT_TRUE(packets_->send(first));
  ASSERT_TRUE(packets_->send(put_moved(1)));
  expect_answer(1);
}

TEST_F(SharedMovedTest, PlacesBeyondTheMemoryAreRefusedByName) {
  using Places = v1::SharedMovedParts;
  const std::uint64_t size = packets_->size();
  const std::pair<const char*, v1::SharedBytes* (Places::*)()> fields[] = {
      {"shared_moved.bodies", &Places::mutable_bodies},
      {"shared_moved.body_positions", &Places::mutable_body_positions},
      {"shared_moved.pose_bodies", &Places::mutable_pose_bodies},
      {"shared_moved.poses", &Places::mutable_poses},
      {"shared_moved.vertices", &Places::mutable_vertices},
      {"shared_moved.vertex_positions", &Places::mutable_vertex_positions}};
  for (const auto& [name, field] : fields) {
    v1::StreamStepsRequest request = put_moved(1);
    v1::SharedBytes& place = *(request.mutable_step()->mutable_shared_moved()->*field)();
    place.set_offset(size - 4);
    place.set_length(5);
    expect_refused(request, name);
    place.set_offset(~std::uint64_t{0});
    place.set_length(4);
    expect_refused(request, name);
  }
  ASSERT_TRUE(packets_->send(put_moved(1)));
  expect_answer(1);
}

TEST_F(SharedMovedTest, WhatItCannotBeIsRefused) {
  v1::StreamStepsRequest request = put_moved(1);
  v1::StepFrame& step = *request.mutable_step();
  step.mutable_moved();
  expect_refused(request, "shared_moved: the frame gives positions or what moved as well");
  step.clear_moved();
  step.set_positions(frame(1));
  expect_refused(request, "shared_moved: the frame gives positions or what moved as well");
  step.clear_positions();
  step.mutable_shared_positions()->set_length(frame(1).size());
  expect_refused(request, "give either");
  step.clear_shared_positions();
  // As a message that cannot be larger than what it is made of.
  step.mutable_shared_moved()->mutable_poses()->set_length(packets_->size());
  expect_refused(request, "its fields overlap");
  step.mutable_shared_moved()->clear_poses();
  step.mutable_shared_moved()->mutable_vertex_positions()->set_length(frame(1).size() - 8);
  expect_refused(request, "moved.vertex_positions");
  step.mutable_shared_moved()->mutable_bodies()->set_length(8);
  expect_refused(request, "moved.bodies");
  ASSERT_TRUE(packets_->send(put_moved(1)));
  expect_answer(1);
}

// Whatever is in the memory when: indices are looked at where they were copied to.
TEST_F(SharedMovedTest, WhoScribblesHarmsNobodyElse) {
  std::jthread scribbler([&](std::stop_token stop) {  // ends with the test, however that ends
    std::mt19937_64 random(7);
    auto* words = reinterpret_cast<std::uint32_t*>(packets_->memory());
    while (!stop.stop_requested()) {
      const std::uint64_t at = random() % 4000;
      std::atomic_ref<std::uint32_t>(words[at]).store(static_cast<std::uint32_t>(random() % 100),
                                                      std::memory_order_relaxed);
    }
  });
  std::uint64_t next = 1;
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(packets_->send(put_moved(next)));
    const auto response = packets_->receive();
    ASSERT_TRUE(response);
    if (response->has_answer())
      ++next;
    else
      EXPECT_EQ(response->error().status().code(), grpc::StatusCode::INVALID_ARGUMENT)
          << response->error().status().message();
  }
  scribbler.request_stop();
  scribbler.join();
  expect_healthy();
}

}  // namespace
}  // namespace warmfront::test
