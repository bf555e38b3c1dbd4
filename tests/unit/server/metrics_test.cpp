// SPDX-License-Identifier: Apache-2.0
// What the daemon reports about itself: metrics, health and readiness over HTTP, and what it tells systemd.
#include "server/observe/metrics.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <regex>
#include <vector>

#include "server/observe/liveness.h"
#include "server/observe/metrics_text.h"
#include "server/observe/process_stats.h"
#include "server/process/systemd.h"
#include "tests/unit/server/http_get.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using server::DurationHistogram;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DurationHistogramTest, EachDurationIsInTheFirstBucketThatHoldsIt) {
  for (const double seconds : {0.0, 1e-6, 1e-5, 1.1e-5, 2e-5, 3e-4, 0.05, 1.0, 41.0, 1e6}) {
    DurationHistogram histogram;
    histogram.observe(seconds);
    std::size_t expected = 0;
    while (expected + 1 < DurationHistogram::kBuckets &&
           seconds > DurationHistogram::upper_bound_seconds(expected))
      ++expected;
    EXPECT_EQ(histogram.count(expected), 1u) << seconds;
    EXPECT_NEAR(histogram.sum_seconds(), seconds, 1e-9 + 1e-9 * seconds);
  }
}

TEST(MetricsTextTest, NamesFollowPrometheusAndNothingIsCountedTwice) {
  server::Metrics metrics;
  StepStatistics statistics;
  statistics.ms.total = 3;
  statistics.front_state = FrontState::kUpdated;
  statistics.rebuild = Rebuild::kDecayed;
  metrics.step_done(statistics, 7, 0.5);
  metrics.refused_with(server::limit_met("full", "max-sessions", true));
  metrics.refused_with("nothing known");
  ++metrics.reload_failures[server::Metrics::kTokenFile];
  metrics.call_began("Step");
  metrics.call_began("no such method");
  const std::string text =
      server::metrics_text(metrics, {.sessions = 3, .traced_sent = 4, .traced_dropped = 5});
  EXPECT_THAT(text, HasSubstr("warmfront_calls_total{method=\"Step\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_calls_total{method=\"StreamSteps\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_traced_frames_total{result=\"sent\"} 4\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_traced_frames_total{result=\"dropped\"} 5\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_reload_failures_total{what=\"token_file\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_reload_failures_total{what=\"certificates\"} 0\n"));
  EXPECT_THAT(text, Not(HasSubstr("\nwarmfront_certificate_expiry_timestamp_seconds"))) << "there is none";
  EXPECT_THAT(server::metrics_text(metrics, {.certificate_expiry = 1'000'000}),
              HasSubstr("\nwarmfront_certificate_expiry_timestamp_seconds 1000000\n"));
  EXPECT_THAT(text, HasSubstr("\nwarmfront_sessions 3\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_contacts_total 7\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_steps_total{front=\"updated\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_rejected_total{reason=\"max-sessions\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_session_rebuilds_total{reason=\"decayed\"} 1\n"));
  EXPECT_THAT(text, Not(HasSubstr("reason=\"none\"")));
  EXPECT_THAT(text, HasSubstr("warmfront_rejected_total{reason=\"other\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_step_duration_seconds_count{stage=\"total\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_step_duration_seconds_bucket{stage=\"total\",le=\"+Inf\"} 1\n"));
  for (const char* quota :
       {"max-streams-per-principal", "max-uploads-per-principal", "max-frames-per-principal"})
    EXPECT_THAT(text, HasSubstr("warmfront_rejected_total{reason=\"" + std::string(quota) + "\"} 0\n"));
  std::istringstream lines(text);
  const std::regex shape("(# (HELP|TYPE) )?(warmfront|process)_[a-z_]+.*");
  for (std::string line; std::getline(lines, line);) EXPECT_TRUE(std::regex_match(line, shape)) << line;
}

class MetricsTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.metrics_listen = "127.0.0.1:0";
    return config;
  }
  MetricsTest() : ServiceTest(config()) {}
};

TEST_F(MetricsTest, AreServedWithHealthAndReadiness) {
  const int port = daemon_->metrics_port();
  ASSERT_GT(port, 0);
  ASSERT_TRUE(create().ok());
  for (std::uint64_t k = 1; k <= 3; ++k) ASSERT_TRUE(step(k, frame(k)).ok());
  EXPECT_FALSE(step(9, frame(9)).ok());
  const std::string text = get(port, "/metrics");
  EXPECT_THAT(text, HasSubstr("HTTP/1.1 200"));
  EXPECT_THAT(text, HasSubstr("\nwarmfront_sessions 1\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_step_duration_seconds_count{stage=\"total\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_queue_duration_seconds_count 3\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_rejected_total{reason=\"frame_out_of_order\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("warmfront_principal_refused_total{principal=\"\"} 1\n"));
  EXPECT_THAT(text, Not(HasSubstr(kId))) << "no session stands in a label";
  const auto process = [&text](const std::string& name) {
    const std::size_t at = text.find("\n" + name + " ");
    return at == std::string::npos ? -1 : std::stod(text.substr(at + name.size() + 2));
  };
  const double seconds = process("warmfront_step_duration_seconds_sum{stage=\"total\"}");
  EXPECT_GT(seconds, 0);
  EXPECT_NEAR(process("warmfront_principal_step_seconds_total{principal=\"\"}"), seconds, 1e-8);
  EXPECT_GT(process("process_resident_memory_bytes"), 1e6);
  EXPECT_GT(process("process_virtual_memory_bytes"), process("process_resident_memory_bytes"));
  EXPECT_GT(process("process_cpu_seconds_total"), 0);
  EXPECT_GT(process("process_open_fds"), 3);
  EXPECT_GT(process("process_max_fds"), process("process_open_fds"));
  EXPECT_GT(process("process_threads"), 2);
  EXPECT_NEAR(process("process_start_time_seconds"), static_cast<double>(std::time(nullptr)), 3600);
  EXPECT_THAT(get(port, "/healthz"), HasSubstr("HTTP/1.1 200"));
  EXPECT_THAT(get(port, "/readyz"), HasSubstr("HTTP/1.1 200"));
  EXPECT_THAT(get(port, "/else"), HasSubstr("HTTP/1.1 404"));
  EXPECT_TRUE(daemon_->drain());
  EXPECT_THAT(get(port, "/healthz"), HasSubstr("HTTP/1.1 200"));
  EXPECT_THAT(get(port, "/readyz"), HasSubstr("HTTP/1.1 503"));
}

// Found by a user: without a descriptor for the listing there seemed to be none.
TEST(ProcessStatsTest, OpenFilesAreCountedWhereNoneIsLeft) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit few = before;
  few.rlim_cur = std::min<rlim_t>(before.rlim_cur, 1024);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  std::vector<int> files;
  for (int file = 0; file >= 0;) {
    file = dup(STDIN_FILENO);
    if (file >= 0) files.push_back(file);
  }
  const int reason = errno;
  const std::uint64_t all = server::process_stats().open_files;
  for (const int file : files) close(file);
  const std::uint64_t others = server::process_stats().open_files;
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(reason, EMFILE);
  EXPECT_GT(files.size(), 10U);
  EXPECT_EQ(all, others + files.size());
}

TEST_F(MetricsTest, ReportWhyTheyAreNotServed) {
  const auto refusal = [](const std::string& address) {
    server::Config config;
    config.listen = {"127.0.0.1:0"};
    config.metrics_listen = address;
    server::Log log(server::LogLevel::kOff, server::LogFormat::kText);
    return server::Daemon::start(config, log).error();
  };
  EXPECT_EQ(refusal("9090").code, ErrorCode::kInvalidArgument);
  const Error taken = refusal("127.0.0.1:" + std::to_string(daemon_->metrics_port()));
  EXPECT_EQ(taken.code, ErrorCode::kUnavailable);
  EXPECT_THAT(taken.message, HasSubstr("Address already in use"));
}

TEST_F(MetricsTest, LogsCarryTheCallersIds) {
  Context context;
  const std::string trace = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";
  context.AddMetadata("x-request-id", "job-17");
  context.AddMetadata("traceparent", trace);
  const auto stream = stub_->StreamSteps(&context);
  stream->Write(attach(kOther));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(daemon_.log(), HasSubstr("\"request_id\":\"job-17\",\"traceparent\":\"" + trace + "\""));
  Context bad;
  bad.AddMetadata("x-request-id", "no \"id\"");
  bad.AddMetadata("traceparent", "00-xyz");
  const auto other = stub_->StreamSteps(&bad);
  other->Write(attach(kOther));
  EXPECT_EQ(other->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(daemon_.log(), Not(HasSubstr("xyz")));
  EXPECT_THAT(daemon_.log(), Not(HasSubstr("no \\\"id")));
}

TEST(LivenessTest, BusyIsAliveAndStuckIsNot) {
  using Clock = std::chrono::steady_clock;
  using std::chrono::seconds;
  server::Liveness liveness;
  Clock::time_point now = Clock::now();
  server::Liveness::Work work;
  const auto beats = [&](int count, seconds processor, std::uint64_t done) {
    for (int i = 0; i < count; ++i) {
      now += seconds(1);
      work.processor_time += processor;
      work.tasks_done += done;
      liveness.beat(work, now);
    }
    return liveness.alive(now);
  };
  EXPECT_TRUE(beats(1000, seconds(0), 0)) << "nothing to do";
  work.running = true;
  EXPECT_TRUE(beats(1000, seconds(1), 0)) << "one step for a thousand seconds";
  EXPECT_TRUE(beats(1000, seconds(0), 1)) << "steps that cost nothing";
  EXPECT_TRUE(beats(59, seconds(0), 0)) << "waiting";
  EXPECT_FALSE(beats(1, seconds(0), 0)) << "waiting for too long";
  EXPECT_TRUE(beats(1, seconds(0), 1)) << "and what it waited for came";
  EXPECT_TRUE(liveness.alive(now + seconds(19)));
  EXPECT_FALSE(liveness.alive(now + seconds(20))) << "no beat";
  // A process that was stopped for an hour.
  now += seconds(3600);
  EXPECT_TRUE(beats(1, seconds(0), 0));
}

TEST_F(MetricsTest, ADaemonThatServesIsAlive) {
  EXPECT_TRUE(daemon_->alive());
  EXPECT_THAT(get(daemon_->metrics_port(), "/healthz"), HasSubstr("200 OK"));
}

TEST_F(MetricsTest, IdleConnectionsDoNotBlockOthers) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(daemon_->metrics_port()));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::array<int, 20> silent{};
  for (int& socket : silent) {
    socket = ::socket(AF_INET, SOCK_STREAM, 0);
    ASSERT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  }
  // The first is still open when the second arrives: no call waited for it.
  EXPECT_THAT(get(daemon_->metrics_port(), "/readyz"), HasSubstr("200 OK"));
  char none = 0;
  EXPECT_EQ(::recv(silent.back(), &none, 1, MSG_DONTWAIT), -1);
  EXPECT_EQ(errno, EAGAIN);
  for (const int socket : silent) ::close(socket);
}

TEST(SystemdTest, IsNotifiedOverItsSocket) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "notify").string();
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  EXPECT_TRUE(server::notify_systemd("READY=1"));
  std::array<char, 64> got{};
  EXPECT_EQ(::recv(socket, got.data(), got.size(), 0), 7);
  EXPECT_STREQ(got.data(), "READY=1");
  // Nobody reads the socket: the sender does not block.
  int sent = 0;
  while (sent < 100'000 && server::notify_systemd("WATCHDOG=1")) ++sent;
  EXPECT_LT(sent, 100'000);
  ::unsetenv("NOTIFY_SOCKET");
  EXPECT_FALSE(server::notify_systemd("READY=1")) << "without systemd nothing happens";
  ::close(socket);
  ::setenv("WATCHDOG_USEC", "30000000", 1);
  EXPECT_EQ(server::watchdog_interval(), std::chrono::seconds(10));
  ::setenv("WATCHDOG_PID", "1", 1);
  EXPECT_FALSE(server::watchdog_interval()) << "it is another process's";
  ::unsetenv("WATCHDOG_PID");
  ::setenv("WATCHDOG_USEC", "soon", 1);
  EXPECT_FALSE(server::watchdog_interval());
  ::unsetenv("WATCHDOG_USEC");
}

}  // namespace
}  // namespace warmfront::test
