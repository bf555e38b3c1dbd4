// SPDX-License-Identifier: Apache-2.0
// Memory runs out in the daemon, at every allocation of a scenario in turn, on any thread: each call ends
// with a status, the session continues with the right contacts, nothing is leaked, and the daemon drains.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <thread>

#include "proto/wire/filters.h"
#include "proto/wire/scene_change_pieces.h"
#include "tests/faults/our_allocations.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;

class ReactionsTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.self_check_steps = 2;
    config.log_level = server::LogLevel::kOff;
    return config;
  }
  ReactionsTest() : ServiceTest(config()) {
    allocations_are_exempt = true;
    expected_ = local_hashes(grids_, 0, 12);
  }

  static std::string id(long n) { return "61234567-89ab-cdef-0123-" + std::to_string(100'000'000'000 + n); }

  /// A call that failed did so for want of memory, and in time.
  static void expect_refused(const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
    EXPECT_FALSE(status.error_message().empty());
  }

  v1::GetServerInfoResponse info() {
    Context context;
    v1::GetServerInfoResponse info;
    EXPECT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
    return info;
  }

  /// Frames from the one that is expected on, on a stream that takes the session as it finds it.
  void goes_on(const std::string& session, std::uint64_t frames) {
    Context context;
    const auto stream = stub_->StreamSteps(&context);
    stream->Write(attach(session));
    v1::StreamStepsResponse response;
    if (!stream->Read(&response)) {
      FAIL() << "attaching: " << stream->Finish().error_message();
    }
    const std::uint64_t first = response.attached().expected_frame();
    for (std::uint64_t k = first; k < first + frames; ++k) {
      stream->Write(frame_message(k, frame(k)));
      ASSERT_TRUE(stream->Read(&response));
      ASSERT_TRUE(response.has_answer()) << response.error().status().message();
      EXPECT_EQ(hash_of(response.answer().contacts()), expected_.at(k - 1)) << "frame " << k;
    }
    stream->Write(detach());
    EXPECT_FALSE(stream->Read(&response));
    const grpc::Status ended = stream->Finish();
    EXPECT_TRUE(ended.ok()) << ended.error_message();
  }

  void remove(const std::string& session) {
    Context context;
    v1::DeleteSessionRequest request;
    request.set_session_id(session);
    v1::DeleteSessionResponse deleted;
    const grpc::Status status = stub_->DeleteSession(&context, request, &deleted);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }

  /// Nothing is left of any call or session; sessions are freed on another thread.
  void expect_nothing_left() {
    v1::GetServerInfoResponse now;
    for (int i = 0; i < 1000; ++i) {
      now = info();
      if (now.sessions() == 0 && now.charged_bytes() == 0 && now.open_streams() == 0 &&
          now.frames_in_flight() == 0)
        return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    FAIL() << now.ShortDebugString();
  }

  /// The scenario for n = 0, 1, ..., its n-th allocation failing, until it has fewer. `scenario` is armed by
  /// arm() and disarmed here.
  template <class Scenario>
  void at_every_allocation(const char* name, Scenario scenario) {
    long n = 0;
    for (int complete = 0; complete < 3;
         ++n) {  // threads come and go: their number is not the same each time
      nth_ = n;
      scenario(n);
      const bool failed = allocations_left.exchange(-1) < 0;
      complete = failed ? 0 : complete + 1;
      expect_nothing_left();
      if (HasFailure()) {
        FAIL() << name << ": allocation " << n;
      }
    }
    std::printf("%s: %ld allocations\n", name, n - 3);
    EXPECT_GT(n, 20) << "a scenario without allocations shows nothing";
  }
  void arm() const { allocations_left = nth_; }
  /// Filters, of no pair.
  PairFilters nothing_left_out() const {
    return {.near_at_rest = 1e-12,
            .rest_positions = grids_.positions(0),
            .patches = std::vector<std::uint32_t>(grids_.vertex_count(), 0)};
  }
  static void disarm() {
    // Kept for at_every_allocation(): below 0 when it failed.
    if (allocations_left.load() >= 0) allocations_left = kDisarmed;
  }

  std::vector<std::uint64_t> expected_;
  long nth_ = 0;
};

TEST_F(ReactionsTest, CreatingASession) {
  at_every_allocation("CreateSession", [&](long n) {
    arm();
    const grpc::Status created = create(id(n));
    disarm();
    if (!created.ok()) {
      expect_refused(created);
      ASSERT_TRUE(create(id(n)).ok()) << "the id is free again";
    }
    goes_on(id(n), 2);
    remove(id(n));
  });
  EXPECT_TRUE(daemon_->drain());
}

// Filters that are parsed, kept and made, and leave nothing out.
TEST_F(ReactionsTest, CreatingWithFilters) {
  const PairFilters filters = nothing_left_out();
  std::vector<v1::CreateSessionRequest> arrays;
  wire::upload(filters, 1000, [&](const v1::CreateSessionRequest& piece) {
    arrays.push_back(piece);
    return true;
  });
  at_every_allocation("CreateSession with filters", [&](long n) {
    v1::SessionHeader announced = header(id(n));
    *announced.mutable_filters() = wire::header_of(filters);
    arm();
    const grpc::Status created = create(announced, faces(), frame(0), arrays);
    disarm();
    if (!created.ok()) {
      expect_refused(created);
      ASSERT_TRUE(create(id(n)).ok()) << "the id is free again";
    }
    goes_on(id(n), 1);
    remove(id(n));
  });
  EXPECT_TRUE(daemon_->drain());
}

TEST_F(ReactionsTest, ChangingFilters) {
  at_every_allocation("ChangeScene", [&](long n) {
    ASSERT_TRUE(create(id(n)).ok());
    v1::ChangeSceneRequest request;
    request.set_session_id(id(n));
    request.set_next_frame(1);
    *request.add_changes()->mutable_change_filters() = wire::to_proto(nothing_left_out());
    arm();
    {
      Context context;
      v1::ChangeSceneResponse response;
      const grpc::Status changed = stub_->ChangeScene(&context, request, &response);
      if (!changed.ok()) expect_refused(changed);
    }
    disarm();
    goes_on(id(n), 1);
    remove(id(n));
  });
  EXPECT_TRUE(daemon_->drain());
}

TEST_F(ReactionsTest, ChangingInPieces) {
  at_every_allocation("StreamChangeScene", [&](long n) {
    ASSERT_TRUE(create(id(n)).ok());
    v1::ChangeSceneRequest request;
    request.set_session_id(id(n));
    request.set_next_frame(1);
    request.set_key("key");
    *request.add_changes()->mutable_change_filters() = wire::to_proto(nothing_left_out());
    arm();
    {
      Context context;
      v1::ChangeSceneResponse response;
      const auto stream = stub_->StreamChangeScene(&context, &response);
      wire::send_pieces(std::move(request), 100,
                        [&](const v1::ChangeSceneRequest& piece) { return stream->Write(piece); });
      stream->WritesDone();
      const grpc::Status changed = stream->Finish();
      if (!changed.ok()) expect_refused(changed);
    }
    disarm();
    goes_on(id(n), 1);
    remove(id(n));
  });
  EXPECT_TRUE(daemon_->drain());
}

TEST_F(ReactionsTest, Streaming) {
  at_every_allocation("StreamSteps", [&](long n) {
    ASSERT_TRUE(create(id(n)).ok());
    arm();
    {
      Context context;
      const auto stream = stub_->StreamSteps(&context);
      stream->Write(attach(id(n)));
      const std::string second = frame(2);
      stream->Write(frame_message(1, frame(1)));
      stream->Write(frame_message(2, second.substr(0, 100), true));
      stream->Write(frame_message(2, second.substr(100)));
      stream->Write(frame_message(3, frame(3)));
      stream->Write(detach());
      v1::StreamStepsResponse response;
      while (stream->Read(&response)) {
        if (response.has_answer()) {
          EXPECT_EQ(hash_of(response.answer().contacts()), expected_.at(response.answer().frame() - 1));
        } else if (response.has_error()) {
          const int code = response.error().status().code();
          EXPECT_TRUE(code == StatusCode::RESOURCE_EXHAUSTED || code == StatusCode::FAILED_PRECONDITION)
              << response.error().status().message();
        }
      }
      const grpc::Status ended = stream->Finish();
      if (!ended.ok()) expect_refused(ended);
    }
    disarm();
    goes_on(id(n), 3);
    remove(id(n));
  });
  EXPECT_TRUE(daemon_->drain());
}

TEST_F(ReactionsTest, UnaryCalls) {
  at_every_allocation("unary calls", [&](long n) {
    ASSERT_TRUE(create(id(n)).ok());
    const auto called = [&](const grpc::Status& status) {
      if (!status.ok()) expect_refused(status);
      return status.ok();
    };
    arm();
    v1::StepResponse response;
    if (called(step(1, frame(1), &response, id(n)))) {
      EXPECT_EQ(hash_of(response.contacts()), expected_.front());
    }
    {
      Context context;
      v1::GetSessionRequest request;
      request.set_session_id(id(n));
      v1::GetSessionResponse session;
      called(stub_->GetSession(&context, request, &session));
    }
    {
      Context context;
      v1::CheckSessionRequest request;
      request.set_session_id(id(n));
      v1::CheckSessionResponse checked;
      if (called(stub_->CheckSession(&context, request, &checked))) {
        EXPECT_EQ(checked.found(), "");
      }
    }
    {
      Context context;
      v1::ListSessionsResponse listed;
      called(stub_->ListSessions(&context, {}, &listed));
    }
    {
      Context context;
      v1::GetServerInfoResponse info;
      called(stub_->GetServerInfo(&context, {}, &info));
    }
    disarm();
    goes_on(id(n), 2);
    remove(id(n));
  });
  EXPECT_TRUE(daemon_->drain());
}

TEST_F(ReactionsTest, DeletingASessionThatIsStreamed) {
  at_every_allocation("DeleteSession", [&](long n) {
    ASSERT_TRUE(create(id(n)).ok());
    Context streaming, deleting;
    const auto stream = open(streaming, 1, id(n));
    arm();
    v1::DeleteSessionRequest request;
    request.set_session_id(id(n));
    v1::DeleteSessionResponse deleted;
    const grpc::Status status = stub_->DeleteSession(&deleting, request, &deleted);
    if (status.ok()) {
      v1::StreamStepsResponse response;
      EXPECT_FALSE(stream->Read(&response));
      const StatusCode ended = stream->Finish().error_code();
      EXPECT_TRUE(ended == StatusCode::NOT_FOUND || ended == StatusCode::RESOURCE_EXHAUSTED) << ended;
    }
    disarm();
    if (status.ok()) return;
    expect_refused(status);
    stream->Write(detach());
    v1::StreamStepsResponse response;
    stream->Read(&response);
    stream->Finish();
    Context again;
    const StatusCode gone = stub_->DeleteSession(&again, request, &deleted).error_code();
    EXPECT_TRUE(gone == StatusCode::OK || gone == StatusCode::NOT_FOUND) << gone;
  });
  EXPECT_TRUE(daemon_->drain());
}

}  // namespace
}  // namespace warmfront::test
