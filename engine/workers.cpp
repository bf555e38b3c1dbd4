// SPDX-License-Identifier: Apache-2.0
#include "engine/workers.h"

#include <sched.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <atomic>
#include <cfenv>
#include <chrono>
#include <exception>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "engine/parallel/default_environment.h"
#include "engine/parallel/give_way.h"

namespace warmfront {
namespace {

using Flag = std::shared_ptr<const std::atomic<bool>>;

// Of the calling thread's own arenas, and of the one that this oneTBB thread is helping in.
thread_local Flag own_flag;
thread_local Flag helping;

// A linked library may have changed MXCSR (rounding, flush to zero) in any thread, so every thread that
// enters the arena is switched to the default environment. A helping one learns whom to give way for.
class Entry final : public tbb::task_scheduler_observer {
 public:
  explicit Entry(tbb::task_arena& arena) : tbb::task_scheduler_observer(arena), flag_(own_flag) {
    observe(true);
  }
  ~Entry() override { observe(false); }
  void on_scheduler_entry(bool is_worker) override {
    std::fesetenv(FE_DFL_ENV);
    if (is_worker) helping = flag_;
  }
  void on_scheduler_exit(bool is_worker) override {
    if (is_worker) helping.reset();
  }

 private:
  const Flag flag_;
};

int thread_count(int asked) {
  if (asked > 0) return asked;
  const unsigned hardware = std::thread::hardware_concurrency();
  return hardware == 0 ? 1 : static_cast<int>(hardware);
}

}  // namespace

struct Workers::Impl {
  Impl(int the_threads, bool may_adapt, Bounds bounds)
      : in_all(allow(the_threads, bounds)), threads(the_threads), adapts(may_adapt) {}

  // By default oneTBB starts at most one thread per core; a higher limit must be set before the arena starts.
  // The least of all limits applies.
  static std::optional<tbb::global_control> allow(int threads, Bounds bounds) {
    if (bounds == Bounds::kOneCall && static_cast<unsigned>(threads) <= std::thread::hardware_concurrency())
      return std::nullopt;
    return std::optional<tbb::global_control>(std::in_place, tbb::global_control::max_allowed_parallelism,
                                              static_cast<std::size_t>(threads));
  }

  const std::optional<tbb::global_control> in_all;
  const int threads;
  const bool adapts;
};

Workers::Workers(int threads, Bounds bounds)
    : impl_(std::make_unique<Impl>(thread_count(threads), threads <= 0 || bounds == Bounds::kProcess,
                                   bounds)) {}
Workers::~Workers() = default;

namespace {

struct Arena {
  explicit Arena(int threads) : arena(threads), entry(arena) {}
  tbb::task_arena arena;
  Entry entry;
};

// The calling thread's own arena with this many slots, created on first use in the default environment,
// because oneTBB passes the environment in which an arena was created to every task.
Arena& own_arena(int threads) {
  thread_local std::vector<std::pair<int, std::unique_ptr<Arena>>> arenas;
  for (const auto& [count, arena] : arenas)
    if (count == threads) return *arena;
  const DefaultEnvironment environment;
  return *arenas.emplace_back(threads, std::make_unique<Arena>(threads)).second;
}

// Another thread of the arena may run the work. oneTBB orders it before the return; the flag states this in a
// form that the thread sanitizer can see.
template <class Work>
void execute(int threads, const Work& work) {
  std::atomic<bool> done{false};
  own_arena(threads).arena.execute([&] {
    work();
    done.store(true, std::memory_order_release);
  });
  static_cast<void>(done.load(std::memory_order_acquire));
}

// Sets a number of the thread, and sets it back at the end.
class Now {
 public:
  Now(int& number, int value) : number_(number), before_(number) { number_ = value; }
  ~Now() { number_ = before_; }
  Now(const Now&) = delete;
  Now& operator=(const Now&) = delete;

 private:
  int& number_;
  const int before_;
};

thread_local int alone = 0;    // number of living OneThreads
thread_local int running = 0;  // number of run()s that the thread is in
thread_local int entered = 0;  // slots of the arena that enter_once() has entered; 0 without one

}  // namespace

// Not more often than once in a millisecond of the thread's time: each time, Linux from 6.6 on takes the rest
// of a slice (3 ms) off its share, where others want the core.
void give_way() {
  using Clock = std::chrono::steady_clock;
  thread_local Clock::time_point due;
  const Flag& flag = helping ? helping : own_flag;
  if (!flag || !flag->load(std::memory_order_relaxed) || Clock::now() < due) return;
  ::sched_yield();
  due = Clock::now() + std::chrono::milliseconds(1);
}

void Workers::give_way() {
  warmfront::give_way();
}

void Workers::give_way_while(std::shared_ptr<const std::atomic<bool>> flag) {
  own_flag = std::move(flag);
}

Workers::OneThread::OneThread() {
  static_cast<void>(own_arena(1));
  ++alone;
}
Workers::OneThread::~OneThread() {
  --alone;
}

int Workers::threads() const {
  return alone > 0 ? 1 : impl_->threads;
}

bool Workers::adapts_to_steps() const {
  return impl_->adapts;
}

void Workers::rouse() noexcept try {
  if (threads() > 1) own_arena(threads()).arena.enqueue([] {});
} catch (const std::exception&) {  // no memory: they are woken up by the work
}

// An arena is its thread's own, so that its tasks are those of the work in hand, and whoever waits may take
// any of them: also what fork_within() shares out, which who is isolated may not. Only work within other work
// must not run tasks of that within its waits: these may use thread-local state.
void Workers::run(const std::function<void()>& work) {
  const auto in_arena = [&work] {
    const DefaultEnvironment environment;
    const bool within = running > 0;
    const Now inside(running, running + 1);
    if (within)
      tbb::this_task_arena::isolate([&work] { work(); });
    else
      work();
  };
  if (entered == threads() && running == 0) return in_arena();
  execute(threads(), in_arena);
}

void Workers::enter_once(const std::function<void()>& work) {
  if (running > 0 || entered > 0) return work();
  execute(threads(), [this, &work] {
    const Now within(entered, threads());
    work();
  });
}

}  // namespace warmfront
