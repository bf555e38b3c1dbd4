// SPDX-License-Identifier: Apache-2.0
// A thread pool with fair queues. Thread safety as stated in the header.
#include "server/session/runner.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "engine/workers.h"

namespace warmfront::server {
namespace {

/// How often it is looked whether someone takes long, while anything runs; and while nothing does.
constexpr std::chrono::milliseconds kGlance{10}, kSleepy{250};

/// For how long after a short task more are expected.
constexpr std::chrono::milliseconds kShortAbout{200};

/// For how long after a packet of another's share more are expected.
constexpr std::chrono::milliseconds kOthersAbout{1000};

/// The thread gets a tenth of a core beside one that wants it all (Linux gives threads priorities of their
/// own). There is no way back without privileges: so it is for threads that end with their task.
void step_back(pid_t thread) {
  constexpr int kNice = 10;
  static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(thread), kNice));
}

}  // namespace

Runner::Runner(int threads, Guests guests, std::optional<Overrun> overrun, Clock clock)
    : lane_threads_(static_cast<std::size_t>(threads)),
      most_guests_{guests.reactions, guests.packets},
      overrun_(overrun),
      clock_(std::move(clock)),
      epoch_(clock_()) {
  {
    const MutexLock lock(mutex_);
    for (const Lane lane : {Lane::kShort, Lane::kLong})
      for (int i = 0; i < threads; ++i) start(lane);
  }
  if (overrun_) watch_ = std::thread([this] { watch(); });
}

Runner::~Runner() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  stopped_.notify_all();
  for (Queue& queue : queues_) queue.changed.notify_all();
  if (watch_.joinable()) watch_.join();  // from here on no thread is added
  for (auto& thread : threads_) thread.thread.join();
}

double Runner::now_ms() const {
  return std::chrono::duration<double, std::milli>(clock_() - epoch_).count();
}

void Runner::start(Lane lane) {
  Thread& thread = threads_.emplace_back();
  thread.lane = lane;
  try {
    thread.gives_way = std::make_shared<std::atomic<bool>>(false);
    thread.thread = std::thread([this, &thread] { work(thread); });
  } catch (...) {
    threads_.pop_back();
    throw;
  }
}

void Runner::post(std::function<void()> task, Lane lane, std::shared_ptr<Share> share) {
  Tasks one;
  one.emplace_back(
      [task = std::move(task)] {
        task();
        return std::optional<Lane>();
      },
      std::move(share));
  post(std::move(one), lane);
}

void Runner::post(Tasks one, Lane lane) noexcept {
  {
    const MutexLock lock(mutex_);
    queue(one, lane);
  }
  queue_of(lane).changed.notify_one();
}

void Runner::queue(Tasks& one, Lane lane) noexcept {
  Queue& queue = queue_of(lane);
  Share& share = share_of(one.front());
  Share::Queue& own = share.queues_[static_cast<std::size_t>(lane)];
  if (own.tasks.empty()) {
    if (share.running_ == 0) share.had_ms_ = std::max(share.had_ms_, least_had_ms_);
    queue.waiting.splice(queue.waiting.end(), own.place);
  }
  own.tasks.splice(own.tasks.end(), one);
  ++queue.tasks;
  count_waiting();
}

Tasks Runner::take(Lane lane) {
  Queue& queue = queue_of(lane);
  auto first = queue.waiting.begin();
  if (std::next(first) != queue.waiting.end()) {
    const double now = now_ms();
    first =
        std::ranges::min_element(queue.waiting, {}, [now](const Share* share) { return share->had(now); });
    least_had_ms_ = std::max(least_had_ms_, (*first)->had(now));
  }
  Share::Queue& own = (*first)->queues_[static_cast<std::size_t>(lane)];
  Tasks one;
  one.splice(one.begin(), own.tasks, own.tasks.begin());
  if (own.tasks.empty()) own.place.splice(own.place.begin(), queue.waiting, first);
  --queue.tasks;
  count_waiting();
  return one;
}

bool Runner::has_room_for(const Share& share, Guest guest, bool brief) noexcept {
  const auto kind = static_cast<std::size_t>(guest);
  int most = most_guests_[kind];
  if (guest == Guest::kPacket) {
    const double now = now_ms();
    const Share* const last = std::exchange(last_packet_, &share);
    if (last != nullptr && last != &share) last_other_ms_ = now;
    if (!brief || now - last_other_ms_ < kOthersAbout.count()) --most;
  }
  return guests_[kind] < most;
}

bool Runner::run_here(Tasks& one, Lane lane, Guest guest, bool brief) noexcept {
  UniqueLock lock(mutex_);
  if (!has_room_for(share_of(one.front()), guest, brief) || queue_of(lane).tasks > 0) return false;
  int& guests = guests_[static_cast<std::size_t>(guest)];
  ++guests;
  if (lane == Lane::kShort) short_begins();
  run(std::move(one), lock);
  --guests;
  return true;
}

// Taken by value, so that what the task holds is released before the next wait.
void Runner::run(Tasks one, UniqueLock& lock) noexcept {
  const std::shared_ptr<Share> share = one.front().share ? one.front().share : own_;
  const double began = now_ms();
  share->begin(began);
  lock.unlock();
  busy_.fetch_add(1, std::memory_order_relaxed);
  const std::optional<Lane> again = one.front().work();
  busy_.fetch_sub(1, std::memory_order_relaxed);
  done_.fetch_add(1, std::memory_order_relaxed);
  if (!again) one.clear();
  lock.lock();
  share->end(began, now_ms());
  if (!again) return;
  queue(one, *again);
  queue_of(*again).changed.notify_one();
}

void Runner::work(Thread& self) {
  Workers::give_way_while(self.gives_way);
  UniqueLock lock(mutex_);
  self.id = ::gettid();
  while (!self.relieved) {
    Queue& own = queue_of(self.lane);
    while (!stopping_ && own.tasks == 0) own.changed.wait(lock);
    // At the end any thread runs what is left: a task may post to a lane whose own threads are gone by then.
    const Lane lane = own.tasks > 0 ? self.lane : self.lane == Lane::kShort ? Lane::kLong : Lane::kShort;
    if (queue_of(lane).tasks == 0) break;
    self.began_ms = now_ms();
    if (lane == Lane::kShort) short_begins();
    run(take(lane), lock);
    self.began_ms = -1;
  }
  if (self.relieved) relieved_.fetch_sub(1, std::memory_order_relaxed);
  self.ended = true;
}

void Runner::watch() {
  UniqueLock lock(mutex_);
  bool soon = false;
  while (!stopping_) {
    stopped_.wait_for(lock, soon ? kGlance : kSleepy);
    try {
      soon = relieve();
    } catch (const std::exception&) {
      soon = true;  // there is no thread, or no memory for one, now
    }
  }
}

bool Runner::relieve() {
  const double now = now_ms();
  let_short_ones_through(now);
  for (auto thread = threads_.begin(); thread != threads_.end();) {
    if (!thread->ended || !thread->relieved) {
      ++thread;
      continue;
    }
    thread->thread.join();  // it has given the lock back for the last time, or is about to
    thread = threads_.erase(thread);
  }
  for (const Lane lane : {Lane::kShort, Lane::kLong}) {
    const auto overrun = overrun_->by_lane[static_cast<std::size_t>(lane)];
    for (Thread& thread : threads_) {
      if (thread.lane != lane || thread.relieved || thread.began_ms < 0 ||
          now - thread.began_ms < std::chrono::duration<double, std::milli>(overrun).count())
        continue;
      if (!relieve(thread)) break;
    }
  }
  return busy() > 0;
}

void Runner::short_begins() {
  if (!overrun_) return;
  const auto is_long = [](const Thread& one) { return one.lane == Lane::kLong && one.began_ms >= 0; };
  if (std::ranges::none_of(threads_, is_long)) return;
  const double now = now_ms();
  const bool known = now - last_short_ms_ < kShortAbout.count();
  last_short_ms_ = now;
  if (!known) let_short_ones_through(now);
}

void Runner::let_short_ones_through(double now) {
  const bool about = now - last_short_ms_ < kShortAbout.count();
  for (const Thread& thread : threads_) {
    if (thread.lane == Lane::kLong && !thread.relieved)
      thread.gives_way->store(about, std::memory_order_relaxed);
  }
}

bool Runner::relieve(Thread& thread) {
  if (relieved_.load(std::memory_order_relaxed) >= overrun_->most) return false;
  start(thread.lane);
  thread.relieved = true;
  thread.gives_way->store(true, std::memory_order_relaxed);
  relieved_.fetch_add(1, std::memory_order_relaxed);
  step_back(thread.id);
  return true;
}

}  // namespace warmfront::server
