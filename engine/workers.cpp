// SPDX-License-Identifier: Apache-2.0
#include "engine/workers.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <atomic>
#include <cfenv>
#include <optional>
#include <thread>

namespace warmfront {
namespace {

// A linked library may have changed MXCSR (rounding, flush to zero) in any thread, so every thread that
// enters the arena is put into the default environment.
class DefaultFloatingPoint final : public tbb::task_scheduler_observer {
 public:
  explicit DefaultFloatingPoint(tbb::task_arena& arena) : tbb::task_scheduler_observer(arena) {
    observe(true);
  }
  ~DefaultFloatingPoint() override { observe(false); }
  void on_scheduler_entry(bool) override { std::fesetenv(FE_DFL_ENV); }
};

// The default environment, and the calling thread's own back at the end.
class CallerEnvironment {
 public:
  CallerEnvironment() {
    std::fegetenv(&saved_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~CallerEnvironment() { std::fesetenv(&saved_); }
  CallerEnvironment(const CallerEnvironment&) = delete;
  CallerEnvironment& operator=(const CallerEnvironment&) = delete;

 private:
  std::fenv_t saved_{};
};

int thread_count(int asked) {
  if (asked > 0) return asked;
  const unsigned hardware = std::thread::hardware_concurrency();
  return hardware == 0 ? 1 : static_cast<int>(hardware);
}

}  // namespace

struct Workers::Impl {
  explicit Impl(int threads) : more_than_cores(allow(threads)), arena(threads), environment(arena) {}

  // oneTBB starts no more threads than the machine has cores unless told to, before the arena starts; the
  // least of what it was told counts.
  static std::optional<tbb::global_control> allow(int threads) {
    if (static_cast<unsigned>(threads) <= std::thread::hardware_concurrency()) return std::nullopt;
    return std::optional<tbb::global_control>(std::in_place, tbb::global_control::max_allowed_parallelism,
                                              static_cast<std::size_t>(threads));
  }

  std::optional<tbb::global_control> more_than_cores;
  tbb::task_arena arena;
  DefaultFloatingPoint environment;
};

// oneTBB hands the environment in which an arena was made to every task, so it is made in the default one.
Workers::Workers(int threads) {
  const CallerEnvironment environment;
  impl_ = std::make_unique<Impl>(thread_count(threads));
}
Workers::~Workers() = default;

namespace {

// The calling thread's own arena of one slot; made when it is first needed.
Workers& own_arena() {
  thread_local Workers workers(1);
  return workers;
}
thread_local int alone = 0;  // OneThreads alive

}  // namespace

Workers::OneThread::OneThread() {
  static_cast<void>(own_arena());
  ++alone;
}
Workers::OneThread::~OneThread() {
  --alone;
}

int Workers::threads() const {
  return alone > 0 ? 1 : impl_->arena.max_concurrency();
}

void Workers::run(const std::function<void()>& work) {
  // Another thread of the arena may do the work. oneTBB orders it before the return; the flag says so in code
  // that the thread sanitizer can see.
  std::atomic<bool> done{false};
  (alone > 0 ? *own_arena().impl_ : *impl_).arena.execute([&] {
    const CallerEnvironment environment;
    // Tasks of another collider in the same arena must not run inside a wait of this one: it may hold
    // thread-local state.
    tbb::this_task_arena::isolate([&work] { work(); });
    done.store(true, std::memory_order_release);
  });
  static_cast<void>(done.load(std::memory_order_acquire));
}

}  // namespace warmfront
