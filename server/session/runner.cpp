// SPDX-License-Identifier: Apache-2.0
// A plain thread pool. Thread safety as stated in the header.
#include "server/session/runner.h"

#include <algorithm>
#include <utility>

namespace warmfront::server {

Runner::Runner(int threads, int guests)
    : lane_threads_(static_cast<std::size_t>(threads)), most_guests_(guests) {
  threads_.reserve(queues_.size() * static_cast<std::size_t>(threads));
  for (Queue& queue : queues_)
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this, &queue] { work(queue); });
}

Runner::~Runner() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  for (Queue& queue : queues_) queue.changed.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Runner::post(std::function<void()> task, Lane lane) {
  Tasks one;
  one.emplace_back([task = std::move(task)] {
    task();
    return std::optional<Lane>();
  });
  post(std::move(one), lane);
}

void Runner::post(Tasks tasks, Lane lane) noexcept {
  Queue& queue = queues_[static_cast<std::size_t>(lane)];
  {
    const MutexLock lock(mutex_);
    queue.tasks.splice(queue.tasks.end(), tasks);
    waiting_short_.store(short_tasks(), std::memory_order_relaxed);
  }
  queue.changed.notify_one();
}

bool Runner::run_here(Tasks& one, Lane lane) noexcept {
  {
    const MutexLock lock(mutex_);
    if (guests_ >= most_guests_ || !queues_[static_cast<std::size_t>(lane)].tasks.empty()) return false;
    ++guests_;
  }
  run(std::move(one));
  const MutexLock lock(mutex_);
  --guests_;
  return true;
}

void Runner::run(Tasks one) noexcept {
  busy_.fetch_add(1, std::memory_order_relaxed);
  const std::optional<Lane> again = one.front()();
  busy_.fetch_sub(1, std::memory_order_relaxed);
  done_.fetch_add(1, std::memory_order_relaxed);
  if (again) post(std::move(one), *again);
}

Runner::Tasks Runner::take(Queue& queue) {
  Tasks one;
  one.splice(one.begin(), queue.tasks, queue.tasks.begin());
  waiting_short_.store(short_tasks(), std::memory_order_relaxed);
  return one;
}

void Runner::work(Queue& own) {
  UniqueLock lock(mutex_);
  for (;;) {
    while (!stopping_ && own.tasks.empty()) own.changed.wait(lock);
    // At the end any thread runs what is left: a task may post to a lane whose own threads are gone by then.
    const auto filled = own.tasks.empty()
                            ? std::ranges::find_if(queues_, [](const Queue& q) { return !q.tasks.empty(); })
                            : queues_.begin() + (&own - queues_.data());
    if (filled == queues_.end()) return;
    Tasks one = take(*filled);
    lock.unlock();
    // Taken by value, so that what the task holds is released before the next wait.
    run(std::move(one));
    lock.lock();
  }
}

}  // namespace warmfront::server
