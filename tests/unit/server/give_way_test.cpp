// SPDX-License-Identifier: Apache-2.0
// Which tasks yield the core, and when: long ones while short ones come and go, and all that were moved off
// their lane.
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <thread>

#include "engine/stop.h"
#include "engine/workers.h"
#include "server/session/runner.h"

namespace {
thread_local long yields = 0;
}

/// The C library's, counted per thread.
extern "C" int sched_yield() noexcept {
  ++yields;
  return static_cast<int>(syscall(SYS_sched_yield));
}

namespace warmfront::server {
namespace {

using std::chrono::milliseconds;

constexpr Runner::Overrun kLate{{milliseconds(600'000), milliseconds(600'000)}};

/// How often a task gives its core away in 20 ms of looks at a stop flag.
long yields_in_a_while() {
  const std::atomic<bool> never{false};
  const StopSignal stop(&never);
  const long before = yields;
  const auto until = std::chrono::steady_clock::now() + milliseconds(20);
  while (std::chrono::steady_clock::now() < until) stop.check();
  return yields - before;
}

/// Does a task that looks at a stop flag give its core away? Beside other work it may have to wait for its
/// second look.
bool gives_way() {
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (std::chrono::steady_clock::now() < until) {
    if (yields_in_a_while() > 0) return true;
  }
  return false;
}

template <class Task>
auto result_of(Runner& runner, Lane lane, Task task) {
  auto result = std::make_shared<std::promise<decltype(task())>>();
  auto got = result->get_future();
  runner.post([result, task] { result->set_value(task()); }, lane);
  return got;
}

TEST(GiveWay, ALongTaskAloneKeepsItsCore) {
  Runner runner(1, {}, kLate);
  EXPECT_EQ(result_of(runner, Lane::kLong, [] { return yields_in_a_while(); }).get(), 0);
}

TEST(GiveWay, ALongTaskLetsShortOnesThrough) {
  Runner runner(1, {}, kLate);
  std::promise<void> begun;
  auto given = result_of(runner, Lane::kLong, [&] {
    begun.set_value();
    return gives_way();
  });
  begun.get_future().wait();
  EXPECT_EQ(result_of(runner, Lane::kShort, [] { return yields_in_a_while(); }).get(), 0)
      << "short ones do not wait";
  EXPECT_TRUE(given.get());
}

TEST(GiveWay, ALongTaskKeepsItsCoreWhereShortOnesCameBeforeIt) {
  Runner runner(1, {}, kLate);
  result_of(runner, Lane::kShort, [] { return 0; }).get();
  EXPECT_EQ(result_of(runner, Lane::kLong, [] { return yields_in_a_while(); }).get(), 0);
}

constexpr Runner::Overrun kSoon{{milliseconds(1), milliseconds(1)}};

TEST(GiveWay, EachRelievedTaskYields) {
  for (const Lane lane : {Lane::kShort, Lane::kLong}) {
    Runner runner(1, {}, kSoon);
    std::promise<void> other;
    auto given = result_of(runner, lane, [&] {
      other.get_future().wait();  // another thread has its place
      return gives_way();
    });
    result_of(runner, lane, [&] {
      other.set_value();
      return 0;
    }).get();
    EXPECT_TRUE(given.get());
  }
}

// Whoever runs a piece of a relieved task's loop gives way in it.
TEST(GiveWay, ThreadsThatHelpALongTaskAlsoYield) {
  Runner runner(1, {}, kSoon);
  std::promise<void> other;
  auto missing = result_of(runner, Lane::kLong, [&] {
    other.get_future().wait();
    Workers workers(4, Workers::Bounds::kProcess);
    std::atomic<int> pieces{0};
    std::atomic<int> without{0};
    workers.run([&] {
      tbb::parallel_for(0, 40, [&](int) {
        ++pieces;
        without += gives_way() ? 0 : 1;
      });
    });
    return pieces == 40 ? without.load() : -1;
  });
  result_of(runner, Lane::kLong, [&] {
    other.set_value();
    return 0;
  }).get();
  EXPECT_EQ(missing.get(), 0);
}

}  // namespace
}  // namespace warmfront::server
