// SPDX-License-Identifier: Apache-2.0
// Fault table, rows 20 and 23: clients that vanish, and very many clients.
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <chrono>
#include <thread>

#include "tests/faults/fault_table.h"
#include "tests/faults/raw_socket.h"

extern char** environ;

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;

/// Waits until `holds`, half a minute at most.
template <class Condition>
bool eventually(Condition holds) {
  for (int i = 0; i < 1500; ++i) {
    if (holds()) return true;
    std::this_thread::sleep_for(20ms);
  }
  return false;
}

TEST_F(FaultTable, Row20_ClientCancels) {
  ASSERT_TRUE(create().ok());
  for (std::uint64_t k = 1; k <= 20; ++k) {
    Context context;
    const auto stream = stub_->StreamSteps(&context);
    stream->Write(attach(kId, true));
    stream->Write(frame_message(k, frame(k)));
    if (k % 2 == 0) stream->Write(frame_message(k + 1, frame(k + 1).substr(0, 100), true));
    v1::StreamStepsResponse response;
    while (stream->Read(&response) && !response.has_answer() && !response.has_error()) {
    }
    EXPECT_TRUE(response.has_answer()) << response.DebugString();
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  v1::StepResponse response;
  ASSERT_TRUE(step(21, frame(21), &response).ok()) << "half a frame counts for nothing";
  EXPECT_EQ(hash_of(response.contacts()), local_hashes(grids_, 0, 21).back());
}

TEST_F(FaultTable, Row20_ConnectionReset) {
  const int port = daemon_->port();
  const std::size_t before = daemon_->open_files();
  for (int i = 0; i < 500; ++i) {
    RawSocket socket(port);
    ASSERT_TRUE(socket.connected());
    socket.send(http2::hello() +
                http2::headers(1, http2::call_headers("/warmfront.v1.CollisionService/StreamSteps")) +
                http2::frame(0, 0, 1, std::string("\0\0\0\0\x7f", 5)));
    socket.reset();
  }
  EXPECT_TRUE(eventually([&] { return daemon_->open_files() <= before + 5; }))
      << daemon_->open_files() << " files, " << before << " before";
}

TEST_F(FaultTable, Row20_ClientIsKilled) {
  allowed_growth_ = allowed_peak_ = 96 * kMiB;  // its session is kept, until it expires
  const std::string address = daemon_->socket();
  const char* arguments[] = {WARMFRONT_BINARY, "detect",        "builtin:cloth-ball",
                             "--server",       address.c_str(), nullptr};
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&quiet, 2, "/dev/null", O_WRONLY, 0);
  pid_t pid = -1;
  ASSERT_EQ(posix_spawn(&pid, WARMFRONT_BINARY, &quiet, nullptr, const_cast<char**>(arguments), environ), 0);
  posix_spawn_file_actions_destroy(&quiet);
  const auto attached = [&](std::uint64_t steps) {
    Context context;
    v1::ListSessionsResponse listed;
    EXPECT_TRUE(stub_->ListSessions(&context, {}, &listed).ok());
    for (const auto& session : listed.sessions())
      if (session.attached() && session.steps() >= steps) return true;
    return false;
  };
  EXPECT_TRUE(eventually([&] { return attached(3); }));
  kill(pid, SIGKILL);
  waitpid(pid, nullptr, 0);
  EXPECT_TRUE(eventually([&] { return !attached(0); })) << "the session is free for the next stream";
  Context context;
  v1::ListSessionsResponse listed;
  ASSERT_TRUE(stub_->ListSessions(&context, {}, &listed).ok());
  EXPECT_EQ(listed.sessions_size(), 2) << "and kept";
}

TEST_F(FaultTable, Row23_TenThousandConnects) {
  // Some 110 KiB for each connection that is open at once, in gRPC; how many there are is bounded by the
  // limit on open files.
  allowed_peak_ = 256 * kMiB;
  allowed_growth_ = 96 * kMiB;
  const int port = daemon_->port();
  const std::size_t before = daemon_->open_files();
  for (int i = 0; i < 10'000; ++i) {
    RawSocket socket(port);
    ASSERT_TRUE(socket.connected()) << i;
    if (i % 7 == 0) socket.reset();
    if (i % 2000 == 0) step_untouched();
  }
  EXPECT_TRUE(eventually([&] { return daemon_->open_files() <= before + 5; }))
      << daemon_->open_files() << " files, " << before << " before";
}

TEST_F(FaultTable, Row23_HandshakesThatStallAndNoFilesLeft) {
  if (kSanitized)
    GTEST_SKIP() << "the sanitizer opens a pipe to check an object, and reports it broken where it cannot";
  allowed_peak_ = 128 * kMiB;
  const int port = daemon_->port();
  daemon_->limit(RLIMIT_NOFILE, daemon_->open_files() + 100);
  std::vector<RawSocket> stalled;
  for (int i = 0; i < 300; ++i) {
    stalled.emplace_back(port);
    if (!stalled.back().connected()) stalled.pop_back();
    if (i % 100 == 50) step_untouched();
  }
  EXPECT_GE(stalled.size(), 200U) << "the kernel connects them, whether or not the daemon can accept";
  // A newcomer is refused at once rather than left to wait.
  EXPECT_TRUE(RawSocket(port).read_all(5000).empty());
  step_untouched();
  std::printf("%zu connections that say nothing, %zu files open\n", stalled.size(), daemon_->open_files());
  stalled.clear();
  // With files to spare again, newcomers are served.
  EXPECT_TRUE(eventually([&] {
    connect("127.0.0.1:" + std::to_string(port));
    return health() == 1;
  }));
}

}  // namespace
}  // namespace warmfront::test
