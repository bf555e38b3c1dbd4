// SPDX-License-Identifier: Apache-2.0
// From serving to stopped: which calls are in flight, and how they are brought to an end. Thread-safe.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <map>
#include <memory>

#include "server/annotations.h"
#include "server/fault.h"

namespace warmfront::server {

/// A call that waits for its client, and so must be told to end. Thread-safe; nothing here throws but in
/// enforce_timeouts().
class Drainable {
 public:
  virtual ~Drainable() = default;
  /// Tells the client that the daemon is about to stop, `deadline` at the latest.
  virtual void notify_draining(std::chrono::system_clock::time_point deadline) = 0;
  /// Takes no more frames; ends once those in hand are delivered.
  virtual void end(const Fault& fault) = 0;
  /// The same, if nothing has come or gone and nothing was in hand for `quiet`.
  virtual void end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) = 0;
  /// Ends when the client has had its time for what it is to send or to take.
  virtual void enforce_timeouts(std::chrono::steady_clock::time_point now) = 0;
  /// Ends, and leaves undone what is in hand.
  virtual void give_up(const Fault& fault) = 0;
  /// Ends as end() does, unless who made the call may still make it.
  virtual void enforce_rights() = 0;
};

class Lifecycle {
 public:
  /// Counts a call as in flight for as long as it lives. Movable; outlived by the lifecycle.
  class Call {
   public:
    Call(Lifecycle& lifecycle, std::uint64_t key) : lifecycle_(&lifecycle), key_(key) {}
    Call(Call&& other) noexcept : lifecycle_(std::exchange(other.lifecycle_, nullptr)), key_(other.key_) {}
    Call& operator=(Call&&) = delete;
    ~Call();

   private:
    Lifecycle* lifecycle_;
    std::uint64_t key_;
  };

  /// UNAVAILABLE while draining. `call` is null for calls that end by themselves.
  Outcome<Call> begin(std::weak_ptr<Drainable> call = {});

  bool draining() const;

  /// Refuses new calls from now on and notifies the streams and uploads. They go on taking the frames that
  /// are under way.
  void begin_drain(std::chrono::system_clock::time_point deadline);
  /// Ends the streams, each after the frames it has in hand; all of them, or those that were quiet for a
  /// while.
  void end_streams();
  void end_quiet_streams(std::chrono::milliseconds quiet);
  /// The same, without what they have in hand.
  void give_up_streams();
  void enforce_timeouts();
  void enforce_rights();
  /// Waits until no call is in flight, `deadline` at the latest; how many are left.
  std::size_t wait_until_idle(std::chrono::steady_clock::time_point deadline);

  static Fault draining_fault();

 private:
  /// Calls it without the lock, and needs no memory. Those that begin meanwhile may be left out.
  template <class Work>
  void each_stream(Work work);

  // Protected by mutex_. Null weak pointers: calls that are no streams.
  mutable Mutex mutex_;
  std::condition_variable ended_;
  bool draining_ WARMFRONT_GUARDED_BY(mutex_) = false;
  std::uint64_t next_key_ WARMFRONT_GUARDED_BY(mutex_) = 0;
  std::map<std::uint64_t, std::weak_ptr<Drainable>> calls_ WARMFRONT_GUARDED_BY(mutex_);
};

}  // namespace warmfront::server
