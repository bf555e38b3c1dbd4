// SPDX-License-Identifier: Apache-2.0
// Sixteen sessions stream while the daemon is killed, drained and started again at random, through a proxy
// that delays, cuts and resets connections. Every frame gets exactly one answer, in order, of the bits that
// an engine in this process gives. For longer than its 10 seconds: WARMFRONT_CHAOS_SECONDS;
// WARMFRONT_CHAOS_SEED for another run.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

#include "client/lib/client.h"
#include "tests/faults/daemon_process.h"
#include "tests/soak/chaos_proxy.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

struct Totals {
  std::atomic<std::uint64_t> sent{0}, answered{0}, different{0}, out_of_order{0}, resumes{0};
};

/// The same frames stepped in this process.
class Reference {
 public:
  explicit Reference(const MovingGrids& grids)
      : grids_(grids),
        scene_(std::make_shared<const Scene>(Scene::create(grids.scene()).value())),
        collider_(Collider::create(scene_, std::span<const double>(start_ = grids.positions(0)), {},
                                   std::make_shared<Workers>(1))
                      .value()) {}

  std::uint64_t next_hash() {
    const std::vector<double> positions = grids_.positions(++frame_);
    ContactHash hash;
    hash.add_step(*scene_, collider_.step(std::span<const double>(positions)).value().contacts);
    return hash.value();
  }

 private:
  const MovingGrids& grids_;
  std::vector<double> start_;
  std::shared_ptr<const Scene> scene_;
  Collider collider_;
  std::uint64_t frame_ = 0;
};

std::uint64_t hash_of(const client::Answer& answer) {
  ContactHash hash;
  const client::ContactTable& table = answer.contacts;
  hash.begin_step(table.size());
  for (std::size_t i = 0; i < table.size(); ++i)
    hash.add(table.kind[i], table.status[i], table.vertices[i], table.toi[i]);
  return hash.value();
}

/// One session's life: streams until `end`, takes all answers, and closes.
void stream(const std::string& address, int number, const std::atomic<bool>& end, Totals& totals) {
  const MovingGrids grids(4 + static_cast<std::uint32_t>(number % 9), 0.2 * number);
  Reference reference(grids);
  const client::ClientOptions patient{.call_timeout = 20s,
                                      .create_timeout = 60s,
                                      .answer_timeout = 30s,
                                      .resume_timeout = 60s,
                                      .max_resumes_without_answer = 1000};
  // Only sessions resume: connecting for the first time may fail like any call.
  Result<client::Client> client = client::Client::connect(address, patient);
  for (int i = 0; i < 100 && !client; ++i) client = client::Client::connect(address, patient);
  ASSERT_TRUE(client.ok()) << client.error().message;
  const std::vector<double> start = grids.positions(0);
  auto session = client.value().create_session(grids.scene(), std::span<const double>(start));
  ASSERT_TRUE(session.ok()) << session.error().message;
  std::uint64_t sent = 0, answered = 0;
  while (!end || answered < sent) {
    while (!end && sent < answered + session.value().window()) {
      const std::vector<double> positions = grids.positions(sent + 1);
      const auto submitted = session.value().submit(std::span<const double>(positions));
      ASSERT_TRUE(submitted.ok()) << "session " << number << ": " << submitted.error().message;
      ASSERT_EQ(submitted.value(), ++sent);
      ++totals.sent;
    }
    if (answered == sent) continue;
    const auto answer = session.value().next_answer();
    ASSERT_TRUE(answer.ok()) << "session " << number << ": " << answer.error().message;
    ++totals.answered;
    if (answer.value().frame != ++answered) ++totals.out_of_order;
    if (hash_of(answer.value()) != reference.next_hash()) ++totals.different;
  }
  EXPECT_EQ(session.value().next_answer().error().code, ErrorCode::kFailedPrecondition)
      << "an answer too many";
  totals.resumes += session.value().resumes();
}

TEST(Chaos, NothingLostNothingDoubleNothingDifferent) {
  const std::uint64_t seconds = number_from("WARMFRONT_CHAOS_SECONDS", 10),
                      seed = number_from("WARMFRONT_CHAOS_SEED", 1);
  constexpr int kSessions = 16;
  constexpr std::uint64_t kEnough = 100;  // frames, of which a slow machine answers a few a second
  DaemonProcess daemon({"--drain-timeout", "5s", "--log-level", "warning", "--self-check-steps", "5"});
  ChaosProxy proxy(daemon.socket().substr(5), seed);
  Totals totals;
  std::atomic<bool> end{false};
  std::vector<std::thread> sessions;
  for (int i = 0; i < kSessions; ++i)
    sessions.emplace_back([&, i] { stream(proxy.address(), i, end, totals); });

  std::mt19937_64 random(seed);
  int kills = 0, drains = 0;
  std::size_t peak = 0;
  const auto begin = Clock::now(), stop = begin + std::chrono::seconds(seconds), late = stop + 180s;
  while (Clock::now() < stop || (totals.answered <= kEnough && Clock::now() < late)) {
    const std::uint64_t before = totals.answered;
    std::this_thread::sleep_for(std::chrono::milliseconds(300 + random() % 1700));
    // On a slow machine a daemon that is killed at fixed times would never answer.
    while (totals.answered == before && Clock::now() < late) std::this_thread::sleep_for(10ms);
    peak = std::max(peak, daemon.peak_bytes());
    if (random() % 4 == 0) {
      daemon.terminate();
      EXPECT_EQ(daemon.wait(), 0) << daemon.log();
      ++drains;
    } else {
      daemon.kill_hard();
      ++kills;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 300));
    daemon.start();
  }
  end = true;
  for (std::thread& session : sessions) session.join();
  const double took = std::chrono::duration<double>(Clock::now() - begin).count();
  const ChaosProxy::Counts& proxied = proxy.counts();
  std::printf(
      "%d sessions, %.0f s, seed %lu: %lu frames answered (%.0f a second), %lu resumes; %d kills, %d drains, "
      "%lu connections of which %lu "
      "cut and %lu reset, %lu delays, %.1f MiB forwarded; daemon %.1f MiB at most; %lu lost, %lu out of "
      "order or double, %lu different\n",
      kSessions, took, static_cast<unsigned long>(seed), static_cast<unsigned long>(totals.answered),
      static_cast<double>(totals.answered) / took, static_cast<unsigned long>(totals.resumes), kills, drains,
      static_cast<unsigned long>(proxied.connections), static_cast<unsigned long>(proxied.cuts),
      static_cast<unsigned long>(proxied.resets), static_cast<unsigned long>(proxied.delays),
      static_cast<double>(proxied.bytes) / (1 << 20), static_cast<double>(peak) / (1 << 20),
      static_cast<unsigned long>(totals.sent - totals.answered),
      static_cast<unsigned long>(totals.out_of_order), static_cast<unsigned long>(totals.different));
  EXPECT_EQ(totals.answered, totals.sent) << "none lost";
  EXPECT_EQ(totals.out_of_order, 0U) << "none double, none out of order";
  EXPECT_EQ(totals.different, 0U) << "none different";
  EXPECT_GT(totals.answered, kEnough);
  EXPECT_GT(kills + drains, 0);
}

}  // namespace
}  // namespace warmfront::test
