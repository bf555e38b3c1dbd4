// SPDX-License-Identifier: Apache-2.0
// Memory stays flat: clients come and go, well-behaved and not, and nothing that the daemon allocated for
// them stays. In rounds of so many sessions, however long they take; WARMFRONT_SOAK_SECONDS adds rounds until
// then.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

#include "tests/faults/fault_table.h"
#include "tests/unit/server/http_get.h"

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Sessions one after another: stepped and deleted, abandoned with a stream on them, or sent invalid
/// messages.
class Churn : public BareClient {
 public:
  Churn(std::string address, int number)
      : address_(std::move(address)), number_(number), random_(static_cast<unsigned>(number)) {}

  /// So many sessions more; all connections are closed afterwards.
  void run(int sessions) {
    for (int i = 0; i < sessions; ++i, ++round_) {
      const std::uint64_t round = round_;
      if (i % 8 == 0) connect(address_);
      const std::string id =
          "5123456" + std::to_string(number_) + "-89ab-cdef-0123-" + std::to_string(100'000'000'000 + round);
      const MovingGrids grids(4 + random_() % 12);
      // Before the upload: what takes long between upload and attach counts as idle.
      const auto expected = local_hashes(grids, 0, 10);
      if (!upload(grids, id)) continue;
      ++sessions_;
      stream(grids, id, expected);
    }
    stub_.reset();
    channel_.reset();
  }
  std::uint64_t sessions() const { return sessions_; }
  std::uint64_t frames() const { return frames_; }
  std::uint64_t wrong() const { return wrong_; }
  std::uint64_t expired() const { return expired_; }

 private:
  bool upload(const MovingGrids& grids, const std::string& id) {
    const SceneDescription scene = grids.scene();
    v1::SessionHeader wanted = header(id);
    wanted.set_vertex_count(grids.vertex_count());
    wanted.set_face_count(static_cast<std::uint32_t>(scene.faces.size()));
    return create(wanted, {reinterpret_cast<const char*>(scene.faces.data()), scene.faces.size() * 12},
                  bytes_of(grids.positions(0)))
        .ok();
  }

  void stream(const MovingGrids& grids, const std::string& id, const std::vector<std::uint64_t>& expected) {
    Context context;
    const auto stream = stub_->StreamSteps(&context);
    stream->Write(attach(id));
    v1::StreamStepsResponse response;
    if (!stream->Read(&response)) {
      // On a busy machine it was idle for too long before it was attached.
      ++(stream->Finish().error_code() == grpc::StatusCode::NOT_FOUND ? expired_ : wrong_);
      return;
    }
    for (std::uint64_t k = 1; k <= expected.size(); ++k) {
      stream->Write(frame_message(k, bytes_of(grids.positions(k))));
      if (!stream->Read(&response) || hash_of(response.answer().contacts()) != expected[k - 1]) ++wrong_;
      ++frames_;
    }
    switch (random_() % 4) {
      case 0:  // vanishes
        context.TryCancel();
        return;
      case 1:  // breaks the rules, then vanishes
        stream->Write(frame_message(99, "short"));
        stream->Write(attach(id));
        while (stream->Read(&response)) {
        }
        if (stream->Finish().error_code() != grpc::StatusCode::FAILED_PRECONDITION) ++wrong_;
        return;
      default: {
        Context remove;
        v1::DeleteSessionRequest request;
        request.set_session_id(id);
        v1::DeleteSessionResponse deleted;
        if (!stub_->DeleteSession(&remove, request, &deleted).ok()) ++wrong_;
      }
    }
  }

  const std::string address_;
  const int number_;
  std::mt19937 random_;
  std::uint64_t round_ = 0;
  std::atomic<std::uint64_t> sessions_{0}, frames_{0}, wrong_{0}, expired_{0};
};

/// A metric's value; -1 when it is not there.
double metric(int port, const std::string& name) {
  const std::string text = get(port, "/metrics");
  const std::size_t at = text.find("\n" + name + " ");
  return at == std::string::npos ? -1 : std::stod(text.substr(at + name.size() + 2));
}

/// What the allocator has handed out once nothing is left of the clients: abandoned sessions expire, and
/// connections are noticed to be closed.
double live_bytes(int port) {
  bool quiet = false;
  for (int i = 0; i < 3000 && !quiet; ++i) {
    std::this_thread::sleep_for(20ms);
    quiet = metric(port, "warmfront_sessions") == 0 && metric(port, "warmfront_open_streams") == 0 &&
            metric(port, "warmfront_session_memory_bytes") == 0;
  }
  EXPECT_TRUE(quiet);
  // The minimum of several measurements: memory about to be freed does not count.
  double least = metric(port, "warmfront_allocated_memory_bytes");
  for (int i = 0; i < 20; ++i) {
    std::this_thread::sleep_for(20ms);
    least = std::min(least, metric(port, "warmfront_allocated_memory_bytes"));
  }
  return least;
}

TEST(Soak, MemoryIsFlat) {
  constexpr int kClients = 4, kSessionsEach = 25, kWarmUp = 2, kRounds = 6;
  // What a session loses is seen: the handshakes and caches of a round differ by less than this a session.
  constexpr double kAllowedBytes = 512;
  const char* text = std::getenv("WARMFRONT_SOAK_SECONDS");
  const double seconds = text == nullptr ? 0 : std::atof(text);
  // Freed memory that a thread keeps at hand would count as handed out.
  const DaemonProcess daemon(
      {"--idle-timeout", "500ms", "--self-check-steps", "3", "--metrics-listen", "127.0.0.1:0"},
      {"GLIBC_TUNABLES=glibc.malloc.tcache_count=0"});
  const int port = daemon.metrics_port();
  std::vector<std::unique_ptr<Churn>> clients;
  for (int i = 0; i < kClients; ++i) clients.push_back(std::make_unique<Churn>(daemon.socket(), i));
  std::vector<double> live;
  const auto start = Clock::now();
  while (live.size() < kRounds || std::chrono::duration<double>(Clock::now() - start).count() < seconds) {
    std::vector<std::jthread> threads;
    for (const auto& client : clients) threads.emplace_back([&] { client->run(kSessionsEach); });
    threads.clear();
    live.push_back(live_bytes(port));
    std::printf("round %zu: %.1f KiB live\n", live.size(), live.back() / 1024);
  }
  std::uint64_t sessions = 0, frames = 0, wrong = 0, expired = 0;
  for (const auto& client : clients) {
    sessions += client->sessions();
    frames += client->frames();
    wrong += client->wrong();
    expired += client->expired();
  }
  const double more = live.back() - live[kWarmUp - 1];
  const double between = static_cast<double>(live.size() - kWarmUp) * kClients * kSessionsEach;
  std::printf("%lu sessions, %lu frames, %lu wrong, %lu expired unused; %.0f bytes more a session\n",
              static_cast<unsigned long>(sessions), static_cast<unsigned long>(frames),
              static_cast<unsigned long>(wrong), static_cast<unsigned long>(expired), more / between);
  EXPECT_EQ(wrong, 0U);
  EXPECT_GT(sessions, expired + 20);
  if (kSanitized) return;
  EXPECT_LT(more / between, kAllowedBytes) << "memory is lost";
}

}  // namespace
}  // namespace warmfront::test
