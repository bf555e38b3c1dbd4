// SPDX-License-Identifier: Apache-2.0
// Fault table, rows 25, 26 and 28: the daemon is stopped or killed, runs out of memory or threads, its clock
// jumps, its log cannot be written.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>

#include "client/lib/client.h"
#include "tests/faults/fault_table.h"
#include "tests/faults/raw_socket.h"

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using grpc::StatusCode;

TEST_F(FaultTable, Row25_DrainedAndKilledWhileStreaming) {
  constexpr std::uint64_t kFrames = 40;
  const MovingGrids grids(8);
  const auto expected = local_hashes(grids, 0, kFrames);
  auto client = client::Client::connect(daemon_->socket(), {.call_timeout = 20s});
  ASSERT_TRUE(client.ok());
  const auto start = grids.positions(0);
  auto session = client.value().create_session(grids.scene(), std::span<const double>(start));
  ASSERT_TRUE(session.ok());
  for (std::uint64_t k = 1; k <= kFrames; ++k) {
    if (k % 20 == 7) {
      daemon_->terminate();
      EXPECT_EQ(daemon_->wait(), 0) << "a drain ends with 0";
      daemon_->start();
    } else if (k % 20 == 14) {
      daemon_->kill_hard();
      daemon_->start();
    }
    const auto positions = grids.positions(k);
    const auto answer = session.value().step(std::span<const double>(positions));
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(answer.value().frame, k);
    ContactHash hash;
    const auto& table = answer.value().contacts;
    hash.begin_step(table.size());
    for (std::size_t i = 0; i < table.size(); ++i)
      hash.add(table.kind[i], table.status[i], table.vertices[i], table.toi[i]);
    EXPECT_EQ(hash.value(), expected[k - 1]) << "frame " << k;
  }
  EXPECT_GE(session.value().resumes(), 4U);
  // The untouched session was lost with the daemon: like its client, it continues from its last frame.
  begin_untouched();
}

TEST_F(FaultTable, Row26_MemoryEndsInTheEngine) {
  if (kSanitized)
    GTEST_SKIP() << "the sanitizer's shadow needs more than any limit that would fail the engine";
  // All faces through all faces: contacts beyond what is left of memory, after a fraction of a second of
  // computing.
  constexpr int kTriangles = 1500;
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<double> apart, together;
  for (int i = 0; i < kTriangles; ++i) {
    faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    for (int corner = 0; corner < 3; ++corner) {
      const double x = corner == 1 ? 1.0 : 0.0, y = corner == 2 ? 1.0 : 0.0;
      apart.insert(apart.end(), {x, y, 10.0 * i});
      together.insert(together.end(), {x, y, -1e-3 * i});
    }
  }
  v1::SessionHeader wanted = header();
  wanted.set_vertex_count(3 * kTriangles);
  wanted.set_face_count(kTriangles);
  const std::string face_bytes(reinterpret_cast<const char*>(faces.data()), faces.size() * 12);
  ASSERT_TRUE(create(wanted, face_bytes, bytes_of(apart)).ok());
  daemon_->limit(RLIMIT_DATA, daemon_->data_bytes() + 32 * kMiB);
  const grpc::Status status = step(1, bytes_of(together));
  EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_THAT(status.error_message(), ::testing::HasSubstr("memory"));
  daemon_->limit(RLIMIT_DATA, RLIM_INFINITY);
  EXPECT_TRUE(step(1, bytes_of(apart)).ok()) << "the session is as it was";
}

TEST_F(FaultTable, Row26_GrpcGetsNoThread) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer wants to be preloaded first";
  begin({}, {"LD_PRELOAD=" WARMFRONT_NO_MORE_THREADS});
  // A deadline that passes in the daemon: gRPC's first thread for timers carries that out, and asks for a
  // second one to wait meanwhile.
  const RawSocket silent(daemon_->port());
  ASSERT_TRUE(silent.send(http2::hello() +
                          http2::headers(1, http2::call_headers("/warmfront.v1.CollisionService/StreamSteps",
                                                                {{"grpc-timeout", "10m"}}))));
  const auto refused = [this] {
    return daemon_->log().find("no thread for grpc_global_tim") != std::string::npos;
  };
  for (int i = 0; i < 3000 && !refused(); ++i) std::this_thread::sleep_for(10ms);
  ASSERT_TRUE(refused()) << daemon_->log();
  for (int i = 0; i < 3; ++i) step_untouched();
  // The daemon ends with 0, as in every row.
}

TEST_F(FaultTable, Row28_TheClockJumps) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer wants to be preloaded first";
  begin({"--idle-timeout", "30m"}, {"LD_PRELOAD=" WARMFRONT_CLOCK_JUMP});
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  v1::StreamStepsResponse response;
  const auto expected = local_hashes(grids_, 0, 100);
  for (std::uint64_t k = 1; k <= 100; ++k) {
    ASSERT_TRUE(stream->Write(frame_message(k, frame(k))) && stream->Read(&response)) << k;
    ASSERT_TRUE(response.has_answer()) << response.DebugString();
    EXPECT_EQ(hash_of(response.answer().contacts()), expected[k - 1]);
    std::this_thread::sleep_for(20ms);
  }
}

TEST_F(FaultTable, Row28_TheLogIsFull) {
  begin({"--log-level", "debug"}, {}, "/dev/full");
  for (int i = 0; i < 50; ++i) expect_healthy();
}

TEST_F(FaultTable, Row28_NobodyReadsTheLog) {
  // A pipe whose reader is gone: writing raises SIGPIPE, which ends a process that does not handle it.
  const TemporaryFolder folder;
  const std::string pipe = folder.path() / "log";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  begin({"--log-level", "debug"}, {}, pipe);
  ::close(reader);
  for (int i = 0; i < 50; ++i) expect_healthy();
}

TEST_F(FaultTable, Row28_AStormOfQuestions) {
  std::vector<std::thread> storm;
  std::atomic<int> answered{0};
  for (int i = 0; i < 4; ++i)
    storm.emplace_back([this, &answered] {
      for (int k = 0; k < 300; ++k) {
        Context info_context, list_context;
        v1::GetServerInfoResponse info;
        v1::ListSessionsResponse list;
        if (stub_->GetServerInfo(&info_context, {}, &info).ok() &&
            stub_->ListSessions(&list_context, {}, &list).ok())
          ++answered;
      }
    });
  for (int i = 0; i < 20; ++i) step_untouched();
  for (std::thread& thread : storm) thread.join();
  EXPECT_EQ(answered, 4 * 300);
}

}  // namespace
}  // namespace warmfront::test
