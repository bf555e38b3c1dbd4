// SPDX-License-Identifier: Apache-2.0
// Which lock protects what, in words that clang checks (-Wthread-safety, on in its builds) and GCC ignores: a
// mutex and its locks that carry them, and macros.
#pragma once

#include <mutex>

#if defined(__clang__)
#define WARMFRONT_ATTRIBUTE(...) __attribute__((__VA_ARGS__))
#else
#define WARMFRONT_ATTRIBUTE(...)
#endif

/// On a member: read and written with `mutex` held.
#define WARMFRONT_GUARDED_BY(mutex) WARMFRONT_ATTRIBUTE(guarded_by(mutex))
/// On a function: called with the mutex held.
#define WARMFRONT_REQUIRES(mutex) WARMFRONT_ATTRIBUTE(requires_capability(mutex))
#define WARMFRONT_ACQUIRE(...) WARMFRONT_ATTRIBUTE(acquire_capability(__VA_ARGS__))
#define WARMFRONT_RELEASE(...) WARMFRONT_ATTRIBUTE(release_capability(__VA_ARGS__))
/// On a function whose locking the analysis cannot follow; a comment says why it is right.
#define WARMFRONT_UNCHECKED_LOCKING WARMFRONT_ATTRIBUTE(no_thread_safety_analysis)

namespace warmfront::server {

/// A std::mutex that the analysis follows.
class WARMFRONT_ATTRIBUTE(capability("mutex")) Mutex : public std::mutex {};

/// Holds the mutex for as long as it lives, as std::lock_guard.
class WARMFRONT_ATTRIBUTE(scoped_lockable) MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) WARMFRONT_ACQUIRE(mutex) WARMFRONT_UNCHECKED_LOCKING : lock_(mutex) {}
  ~MutexLock() WARMFRONT_RELEASE() WARMFRONT_UNCHECKED_LOCKING {}
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  const std::lock_guard<std::mutex> lock_;
};

/// The same, for waiting on a std::condition_variable (in a loop: a predicate is a function of its own to the
/// analysis) and for letting go in between.
class WARMFRONT_ATTRIBUTE(scoped_lockable) UniqueLock : public std::unique_lock<std::mutex> {
 public:
  explicit UniqueLock(Mutex& mutex) WARMFRONT_ACQUIRE(mutex) WARMFRONT_UNCHECKED_LOCKING
      : std::unique_lock<std::mutex>(mutex) {}
  ~UniqueLock() WARMFRONT_RELEASE() WARMFRONT_UNCHECKED_LOCKING {}
  UniqueLock(const UniqueLock&) = delete;
  UniqueLock& operator=(const UniqueLock&) = delete;

  void lock() WARMFRONT_ACQUIRE() WARMFRONT_UNCHECKED_LOCKING { std::unique_lock<std::mutex>::lock(); }
  void unlock() WARMFRONT_RELEASE() WARMFRONT_UNCHECKED_LOCKING { std::unique_lock<std::mutex>::unlock(); }
};

}  // namespace warmfront::server
