// SPDX-License-Identifier: Apache-2.0
// Limits on memory, streams and frames in flight, as seen by a client: a refusal names the setting and the
// retry delay, and sessions continue.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>
#include <vector>

#include "server/session/account.h"
#include "server/session/answer.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

/// A refusal by any limit.
void expect_refused(const grpc::Status& status, const char* setting, bool passing) {
  EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_LIMIT);
  EXPECT_EQ(detail_of(status).limit(), setting);
  EXPECT_EQ(detail_of(status).has_retry_after_ms(), passing);
  EXPECT_THAT(status.error_message(), HasSubstr(std::string("--") + setting));
}

class MemoryTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_session_bytes = 1 << 20;
    // Room for one session of the fixture's size, not for two.
    config.limits.max_total_bytes = 300 << 10;
    return config;
  }
  MemoryTest() : ServiceTest(config()) {}

  v1::GetServerInfoResponse info() {
    Context context;
    v1::GetServerInfoResponse info;
    EXPECT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
    return info;
  }
};

TEST_F(MemoryTest, ASessionIsRefusedBeforeItIsUploadedAndTakenWhenThereIsRoom) {
  v1::SessionHeader large = header(kOther);
  large.set_vertex_count(1'000'000);
  large.set_face_count(1'000'000);
  expect_refused(create(large, "", ""), "max-session-bytes", false);
  ASSERT_TRUE(create().ok());
  EXPECT_GT(info().charged_bytes(), 50u << 10);
  expect_refused(create(kOther), "max-total-bytes", true);
  EXPECT_EQ(info().sessions(), 1u) << "the refused one left its place";
  ASSERT_TRUE(step(1, frame(1)).ok());
  Context remove;
  v1::DeleteSessionRequest request;
  request.set_session_id(kId);
  v1::DeleteSessionResponse deleted;
  ASSERT_TRUE(stub_->DeleteSession(&remove, request, &deleted).ok());
  // Freed on another thread.
  for (int i = 0; i < 500 && info().charged_bytes() > 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(info().charged_bytes(), 0u);
  expect_healthy();
}

TEST_F(MemoryTest, WhatIsHeldIsCountedWithAnswers) {
  ASSERT_TRUE(create().ok());
  const auto held = [&] { return session_info().memory_bytes(); };
  const std::uint64_t before = held();
  EXPECT_GT(before, 1000u);
  v1::StepResponse response;
  ASSERT_TRUE(step(1, frame(1), &response).ok());
  EXPECT_GE(held(), before + 26 * response.summary().rows());
}

TEST(UsableMemoryTest, IsTheLeastOfTheControlGroupsOfEitherVersion) {
  constexpr std::size_t kGiB = std::size_t{1} << 30;
  const auto limit = [](const std::string& membership, const std::map<std::string, std::string>& files) {
    const TemporaryFolder root;
    const auto put = [&](const std::string& path, const std::string& text) {
      const std::filesystem::path file = root.path().string() + path;
      std::filesystem::create_directories(file.parent_path());
      std::ofstream(file) << text << "\n";
    };
    put("/proc/self/cgroup", membership);
    for (const auto& [path, text] : files) put("/sys/fs/cgroup" + path, text);
    return server::control_group_limit(8 * kGiB, root.path().string());
  };
  EXPECT_EQ(limit("0::/", {}), 8 * kGiB);
  // Version 2: the group's own, one above it, and none.
  EXPECT_EQ(limit("0::/a/b", {{"/a/b/memory.max", "1073741824"}, {"/a/memory.max", "max"}}), kGiB);
  EXPECT_EQ(limit("0::/a/b", {{"/a/b/memory.max", "max"}, {"/a/memory.max", "2147483648"}}), 2 * kGiB);
  // Version 1, among other controllers, with its number for no limit.
  const std::string old = "12:cpu,cpuacct:/x\n7:memory:/a/b\n1:name=systemd:/y\n0::/z";
  EXPECT_EQ(limit(old, {{"/memory/a/b/memory.limit_in_bytes", "1073741824"},
                        {"/memory/a/memory.limit_in_bytes", "9223372036854771712"}}),
            kGiB);
  EXPECT_EQ(limit(old, {{"/memory/a/b/memory.limit_in_bytes", "9223372036854771712"}}), 8 * kGiB);
  // In a container, whose group is mounted as the root, and its path is what it is called outside.
  EXPECT_EQ(limit("5:memory:/docker/0123", {{"/memory/memory.limit_in_bytes", "536870912"}}), kGiB / 2);
  // Another controller's folder is not looked at, nor a name that only begins like it.
  EXPECT_EQ(limit("5:memory2:/a", {{"/memory/a/memory.limit_in_bytes", "1"}}), 8 * kGiB);
  EXPECT_EQ(limit("", {}), 8 * kGiB);
}

TEST(LimitsTest, NoSessionMayHoldMoreThanAllTogetherOrThanThereIs) {
  const server::Limits defaults;
  EXPECT_LE(defaults.max_session_bytes, defaults.max_total_bytes);
  EXPECT_LE(defaults.max_session_bytes, server::usable_memory_bytes());
  EXPECT_LE(defaults.max_session_bytes, std::size_t{8} << 30);
  constexpr std::size_t kGiB = std::size_t{1} << 30;
  server::Limits limits;
  limits.max_session_bytes = 8 * kGiB;
  limits.max_total_bytes = 3 * kGiB;
  EXPECT_THAT(server::fit_to_memory(limits, 4 * kGiB),
              ::testing::ElementsAre(HasSubstr("lowered from 8.0 GiB to 3.0 GiB, which is max-total-bytes")));
  EXPECT_EQ(limits.max_session_bytes, 3 * kGiB);
  EXPECT_THAT(server::fit_to_memory(limits, 4 * kGiB), ::testing::IsEmpty());
  limits.max_total_bytes = 16 * kGiB;
  limits.max_session_bytes = 8 * kGiB;
  EXPECT_THAT(
      server::fit_to_memory(limits, 4 * kGiB),
      ::testing::ElementsAre(HasSubstr("max-total-bytes is 16.0 GiB"), HasSubstr("this process may use")));
  EXPECT_EQ(limits.max_session_bytes, 4 * kGiB);
  EXPECT_EQ(limits.max_total_bytes, 16 * kGiB) << "as it was set";
}

TEST_F(MemoryTest, ADaemonStatesTheLimitsOfItsSessions) {
  EXPECT_EQ(info().limits().max_session_bytes(), 300u << 10) << "a mebibyte was set, of 300 KiB in all";
  EXPECT_THAT(daemon_.log(), HasSubstr("max-session-bytes is lowered"));
}

class ExplainTest : public ServiceTest {
 protected:
  static std::size_t estimate(bool explain) {
    return server::estimate_bytes(100'000, 200'000, 8, explain, false, server::Limits());
  }
  static server::Config config() {
    server::Config config;
    // Room for a session that does not explain, and for nothing besides.
    config.limits.max_session_bytes = estimate(false);
    return config;
  }
  ExplainTest() : ServiceTest(config()) {}
};

TEST_F(ExplainTest, ASessionWithExplainReservesItsSecondCollider) {
  v1::SessionHeader wanted = header();
  wanted.set_vertex_count(100'000);
  wanted.set_face_count(200'000);
  wanted.mutable_options()->set_explain(true);
  expect_refused(create(wanted, "", ""), "max-session-bytes", false);
  wanted.mutable_options()->set_explain(false);
  EXPECT_EQ(create(wanted, "", "").error_code(), StatusCode::INVALID_ARGUMENT)
      << "let in; then the faces are missed";
  expect_healthy();
}

class GrownTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_session_bytes = 300 << 10;
    return config;
  }
  GrownTest() : ServiceTest(config()) {}
};

TEST_F(GrownTest, CapacitiesAreLoweredSoThatAStepIsBoundedBeforeItBegins) {
  ASSERT_TRUE(create().ok());
  Context context;
  v1::GetSessionRequest request;
  request.set_session_id(kId);
  v1::GetSessionResponse response;
  ASSERT_TRUE(stub_->GetSession(&context, request, &response).ok());
  EXPECT_LE(response.session().options().max_front_bytes(), 150u << 10);
  EXPECT_LE(response.session().options().max_contacts() * server::held_per_contact({}), 150u << 10);

  // With explain, front and contacts are held twice.
  v1::SessionHeader explaining = header(kOther);
  explaining.mutable_options()->set_explain(true);
  ASSERT_TRUE(create(explaining, faces(), bytes_of(grids_.positions(0))).ok());
  Context again;
  request.set_session_id(kOther);
  ASSERT_TRUE(stub_->GetSession(&again, request, &response).ok());
  EXPECT_LE(response.session().options().max_front_bytes(), 75u << 10);
  EXPECT_LE(response.session().options().max_contacts() * server::held_per_contact({}), 75u << 10);
}

class FewStreamsTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_open_streams = 1;
    return config;
  }
  FewStreamsTest() : ServiceTest(config()) {}
};

TEST_F(FewStreamsTest, OneStreamTooManyIsRefusedAndTheOtherContinues) {
  ASSERT_TRUE(create().ok());
  Context first, second, third;
  const auto holder = open(first, 1);
  const auto refused = stub_->StreamSteps(&second);
  v1::StreamStepsResponse response;
  EXPECT_FALSE(refused->Read(&response));
  expect_refused(refused->Finish(), "max-open-streams", true);
  holder->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(holder->Read(&response));
  EXPECT_EQ(response.answer().frame(), 1u);
  holder->Write(detach());
  EXPECT_FALSE(holder->Read(&response));
  EXPECT_TRUE(holder->Finish().ok());
}

class FewFramesTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_frames_in_flight = 1;
    return config;
  }
  FewFramesTest() : ServiceTest(config()) {}
};

TEST_F(FewFramesTest, AFrameTooManyIsAnsweredInItsTurnAndCanBeSentAgain) {
  ASSERT_TRUE(create().ok());
  ASSERT_TRUE(create(kOther).ok());
  Context first, second;
  const auto stream = open(first, 1);
  // A frame that is not complete yet is in flight.
  stream->Write(frame_message(1, frame(1).substr(0, 100), true));
  Context poll;
  v1::GetServerInfoResponse info;
  for (int i = 0; i < 500 && info.frames_in_flight() == 0; ++i) {
    Context context;
    ASSERT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const auto other = open(second, 1, kOther);
  other->Write(frame_message(1, frame(1)));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(other->Read(&response));
  ASSERT_TRUE(response.has_error());
  EXPECT_EQ(response.error().frame(), 1u);
  EXPECT_EQ(response.error().status().code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(detail_of(response.error().status()).limit(), "max-frames-in-flight");
  expect_refused(step(1, frame(1), nullptr, kOther), "max-frames-in-flight", true);
  stream->Write(frame_message(1, frame(1).substr(100)));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.answer().frame(), 1u);
  other->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(other->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), local_hashes(grids_, 0, 1).front());
}

class SmallMessagesTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_message_bytes = 64 << 10;
    return config;
  }
  SmallMessagesTest() : ServiceTest(config()) {}

  std::uint64_t last_frame() { return session_info().last_frame(); }
  /// The frame's contacts over a stream.
  v1::ContactColumns streamed(std::uint64_t frame, std::uint64_t expected_frame) {
    Context context;
    const auto stream = open(context, expected_frame);
    stream->Write(frame_message(frame, bytes_of(large_.positions(frame))));
    v1::ContactColumns all;
    v1::StreamStepsResponse response;
    do {
      EXPECT_TRUE(stream->Read(&response) && response.has_answer());
      all.mutable_kind()->append(response.answer().contacts().kind());
      all.mutable_status()->append(response.answer().contacts().status());
      all.mutable_v()->append(response.answer().contacts().v());
      all.mutable_toi()->append(response.answer().contacts().toi());
    } while (response.has_answer() && !response.answer().last());
    stream->Write(detach());
    EXPECT_FALSE(stream->Read(&response));
    EXPECT_TRUE(stream->Finish().ok());
    return all;
  }

  const MovingGrids large_{30};
};

TEST_F(SmallMessagesTest, AFrameWhoseAnswerIsLargerThanAMessageDoesNotCount) {
  const SceneDescription scene = large_.scene();
  v1::SessionHeader wanted = header();
  wanted.set_vertex_count(large_.vertex_count());
  wanted.set_face_count(static_cast<std::uint32_t>(scene.faces.size()));
  for (const auto set :
       {&v1::ContactFields::set_weights, &v1::ContactFields::set_normal, &v1::ContactFields::set_points})
    (wanted.mutable_options()->mutable_fields()->*set)(true);
  ASSERT_TRUE(create(wanted, {reinterpret_cast<const char*>(scene.faces.data()), scene.faces.size() * 12},
                     bytes_of(large_.positions(0)))
                  .ok());
  for (int again = 0; again < 2; ++again) {
    expect_refused(step(1, bytes_of(large_.positions(1))), "max-message-bytes", false);
    EXPECT_EQ(last_frame(), 0U) << "what failed does not count";
  }
  const std::uint64_t expected = local_hashes(large_, 0, 1).front();
  EXPECT_EQ(hash_of(streamed(1, 1)), expected) << "the same frame";
  const grpc::Status answered = step(1, bytes_of(large_.positions(1)));
  expect_refused(answered, "max-message-bytes", false);
  EXPECT_THAT(answered.error_message(), HasSubstr("frame 1 is answered"));
  EXPECT_EQ(hash_of(streamed(1, 2)), expected) << "a stream gets the cached answer";
}

TEST_F(ServiceTest, EngineLimitsAreNamedInErrors) {
  // A fan around one vertex: more pairs of faces share it than the engine lists.
  constexpr std::int32_t kFaces = 10'000;
  std::vector<std::array<std::int32_t, 3>> fan;
  for (std::int32_t i = 0; i < kFaces; ++i) fan.push_back({0, i + 1, i + 2});
  std::vector<double> positions;
  for (std::int32_t i = 0; i < kFaces + 2; ++i) positions.insert(positions.end(), {i * 1.0, i * i * 1e-3, 0});
  v1::SessionHeader hub = header(kOther);
  hub.set_vertex_count(kFaces + 2);
  hub.set_face_count(kFaces);
  const grpc::Status refused =
      create(hub, {reinterpret_cast<const char*>(fan.data()), fan.size() * 12}, bytes_of(positions));
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED) << refused.error_message();
  EXPECT_EQ(detail_of(refused).reason(), v1::ERROR_REASON_LIMIT);
  EXPECT_EQ(detail_of(refused).limit(), "adjacent-faces");
  EXPECT_THAT(refused.error_message(), HasSubstr("vertex 0 alone is in 10000 faces"));

  v1::SessionHeader few = header();
  few.mutable_options()->set_max_contacts(1);
  ASSERT_TRUE(create(few, faces(), frame(0)).ok());
  const grpc::Status many = step(1, frame(1));
  EXPECT_EQ(detail_of(many).limit(), "max-contacts") << many.error_message();
}

}  // namespace
}  // namespace warmfront::test
