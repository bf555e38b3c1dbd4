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
  Queue& queue = queues_[static_cast<std::size_t>(lane)];
  {
    const MutexLock lock(mutex_);
    queue.tasks.push_back(std::move(task));
    waiting_short_.store(short_tasks(), std::memory_order_relaxed);
  }
  queue.changed.notify_one();
}

bool Runner::run_here(const std::function<void()>& task, Lane lane) noexcept {
  {
    const MutexLock lock(mutex_);
    if (guests_ >= most_guests_ || !queues_[static_cast<std::size_t>(lane)].tasks.empty()) return false;
    ++guests_;
  }
  busy_.fetch_add(1, std::memory_order_relaxed);
  task();
  busy_.fetch_sub(1, std::memory_order_relaxed);
  const MutexLock lock(mutex_);
  --guests_;
  return true;
}

std::function<void()> Runner::take(Queue& queue) {
  std::function<void()> task = std::move(queue.tasks.front());
  queue.tasks.pop_front();
  waiting_short_.store(short_tasks(), std::memory_order_relaxed);
  return task;
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
    // Scoped, so that what the task holds is released before the next wait.
    {
      const std::function<void()> task = take(*filled);
      lock.unlock();
      busy_.fetch_add(1, std::memory_order_relaxed);
      task();
      busy_.fetch_sub(1, std::memory_order_relaxed);
    }
    lock.lock();
  }
}

}  // namespace warmfront::server
