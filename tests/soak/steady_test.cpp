// SPDX-License-Identifier: Apache-2.0
// Memory stays flat: clients come and go, well-behaved and not, and what the daemon holds once it has warmed
// up does not grow. For longer than its 60 seconds: WARMFRONT_SOAK_SECONDS.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

#include "tests/faults/fault_table.h"

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Sessions one after another: stepped and deleted, abandoned with a stream on them, or fed with what is
/// none.
class Churn : public BareClient {
 public:
  Churn(std::string address, int number)
      : address_(std::move(address)), number_(number), random_(static_cast<unsigned>(number)) {}

  void run(const std::atomic<bool>& end) {
    for (std::uint64_t round = 0; !end; ++round) {
      if (round % 8 == 0) connect(address_);
      const std::string id =
          "5123456" + std::to_string(number_) + "-89ab-cdef-0123-" + std::to_string(100'000'000'000 + round);
      const MovingGrids grids(4 + random_() % 12);
      // Before the upload: what takes long between upload and attach counts as idle.
      const auto expected = local_hashes(grids, 0, 10);
      if (!upload(grids, id)) continue;
      ++sessions_;
      stream(grids, id, expected);
    }
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
  std::atomic<std::uint64_t> sessions_{0}, frames_{0}, wrong_{0}, expired_{0};
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

TEST(Soak, MemoryIsFlat) {
  const char* text = std::getenv("WARMFRONT_SOAK_SECONDS");
  const double seconds = text == nullptr ? 60 : std::atof(text);
  ASSERT_GE(seconds, 10);
  const DaemonProcess daemon(
      {"--idle-timeout", "500ms", "--log-level", "warning", "--self-check-steps", "3"});
  std::vector<std::unique_ptr<Churn>> clients;
  std::vector<std::thread> threads;
  std::atomic<bool> end{false};
  for (int i = 0; i < 4; ++i) clients.push_back(std::make_unique<Churn>(daemon.socket(), i));
  for (const auto& client : clients) threads.emplace_back([&] { client->run(end); });
  std::vector<double> mebibytes;
  const auto start = Clock::now();
  while (std::chrono::duration<double>(Clock::now() - start).count() < seconds) {
    std::this_thread::sleep_for(250ms);
    mebibytes.push_back(static_cast<double>(daemon.resident_bytes()) / kMiB);
  }
  end = true;
  for (std::thread& thread : threads) thread.join();
  std::uint64_t sessions = 0, frames = 0, wrong = 0, expired = 0;
  for (const auto& client : clients) {
    sessions += client->sessions();
    frames += client->frames();
    wrong += client->wrong();
    expired += client->expired();
  }
  // The first third warms up; then two windows far apart are compared.
  const std::size_t third = mebibytes.size() / 3, window = mebibytes.size() / 6;
  const auto at = [&](std::size_t index) { return mebibytes.begin() + static_cast<std::ptrdiff_t>(index); };
  const double before = median({at(third), at(third + window)});
  const double after = median({at(mebibytes.size() - window), at(mebibytes.size())});
  std::printf(
      "%.0f s: %lu sessions, %lu frames, %lu wrong, %lu expired unused; memory %.1f MiB a third in, %.1f at "
      "the end, %.1f at "
      "most\n",
      seconds, static_cast<unsigned long>(sessions), static_cast<unsigned long>(frames),
      static_cast<unsigned long>(wrong), static_cast<unsigned long>(expired), before, after,
      *std::max_element(mebibytes.begin(), mebibytes.end()));
  EXPECT_EQ(wrong, 0U);
  EXPECT_GT(sessions, expired + 20);
  if (kSanitized) return;
  // The allocator's arenas settle late on a busy machine, anywhere between 43 and 51 MiB; a kilobyte lost a
  // session would show.
  EXPECT_LE(after, before * 1.05 + 10) << "memory grows";
}

}  // namespace
}  // namespace warmfront::test
