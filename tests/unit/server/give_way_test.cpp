// SPDX-License-Identifier: Apache-2.0
// Who lets others have the core, and when: long tasks while short ones come and go, and all that are
// relieved.
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

/// What a task gives away in so many looks at a stop flag.
long yields_in(int looks) {
  const std::atomic<bool> never{false};
  const StopSignal stop(&never);
  const long before = yields;
  for (int i = 0; i < looks; ++i) stop.check();
  return yields - before;
}

template <class Task>
auto result_of(Runner& runner, Lane lane, Task task) {
  auto result = std::make_shared<std::promise<decltype(task())>>();
  auto got = result->get_future();
  runner.post([result, task] { result->set_value(task()); }, lane);
  return got;
}

TEST(GiveWay, ALongTaskAloneKeepsItsCore) {
  Runner runner(1, 0, kLate);
  EXPECT_EQ(result_of(runner, Lane::kLong, [] { return yields_in(1000); }).get(), 0);
}

TEST(GiveWay, ALongTaskLetsShortOnesThrough) {
  Runner runner(1, 0, kLate);
  std::promise<void> begun;
  auto given = result_of(runner, Lane::kLong, [&] {
    begun.set_value();
    const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    long sum = 0;
    while (sum == 0 && std::chrono::steady_clock::now() < until) sum += yields_in(10);
    return sum;
  });
  begun.get_future().wait();
  EXPECT_EQ(result_of(runner, Lane::kShort, [] { return yields_in(1000); }).get(), 0)
      << "short ones do not wait";
  EXPECT_GT(given.get(), 0);
}

TEST(GiveWay, ALongTaskKeepsItsCoreWhereShortOnesCameBeforeIt) {
  Runner runner(1, 0, kLate);
  result_of(runner, Lane::kShort, [] { return 0; }).get();
  EXPECT_EQ(result_of(runner, Lane::kLong, [] { return yields_in(1000); }).get(), 0);
}

TEST(GiveWay, EachThatIsRelieved) {
  for (const Lane lane : {Lane::kShort, Lane::kLong}) {
    Runner runner(1, 0, kLate);
    std::promise<void> other;
    auto given = result_of(runner, lane, [&] {
      runner.step_back_now();
      runner.step_back_now();     // is the same as once
      other.get_future().wait();  // another thread has its place
      return yields_in(1000);
    });
    result_of(runner, lane, [&] {
      other.set_value();
      return 0;
    }).get();
    EXPECT_EQ(given.get(), 1000);
  }
}

// Whoever runs a piece of a relieved task's loop gives way in it.
TEST(GiveWay, SoDoTheThreadsThatHelpOne) {
  Runner runner(1, 0, kLate);
  const auto missing = result_of(runner, Lane::kLong, [&] {
                         runner.step_back_now();
                         Workers workers(4, Workers::Bounds::kProcess);
                         std::atomic<int> pieces{0};
                         std::atomic<int> without{0};
                         workers.run([&] {
                           tbb::parallel_for(0, 400, [&](int) {
                             ++pieces;
                             without += yields_in(10) != 10;
                             std::this_thread::sleep_for(milliseconds(1));  // so that others come and help
                           });
                         });
                         return pieces == 400 ? without.load() : -1;
                       }).get();
  EXPECT_EQ(missing, 0);
}

}  // namespace
}  // namespace warmfront::server
