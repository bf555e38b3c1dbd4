// SPDX-License-Identifier: Apache-2.0
// What a computation forks into, and how long each piece takes, recorded on one thread: for measuring how far
// it could be spread over cores that are not there. Used by one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

namespace warmfront {

/// Where something is written. Clang 14 has no std::source_location.
struct ForkPlace {
  const char* file;
  std::uint32_t line;

  /// The caller's place.
  static constexpr ForkPlace here(const char* file = __builtin_FILE(),
                                  std::uint32_t line = __builtin_LINE()) {
    return {file, line};
  }
};

class ForkTrace {
 public:
  enum class Kind : std::uint8_t {
    kStrand,   ///< so many seconds of work in which nothing forks or joins
    kFork,     ///< tasks follow, in any order or at once
    kTask,     ///< one of them begins
    kTaskEnd,  ///< and ends
    kJoin,     ///< all of them have ended
  };
  struct Event {
    Kind kind;
    double seconds = 0;          ///< of kStrand
    const char* file = nullptr;  ///< of kFork: where it is
    std::uint32_t line = 0;
  };

  /// While one lives, what the calling thread forks is recorded in the trace, and runs on this thread alone.
  /// Its time between the two is the trace's work.
  class Recording {
   public:
    explicit Recording(ForkTrace& trace);
    ~Recording();
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;
  };

  /// The one that the calling thread records in; null if it does not.
  static ForkTrace* of_thread() { return current; }

  class Fork {
   public:
    Fork(ForkTrace& trace, const ForkPlace& place) : trace_(trace) {
      trace.end_strand();
      trace.events_.push_back({Kind::kFork, 0, place.file, place.line});
    }
    ~Fork() { trace_.mark(Kind::kJoin); }
    Fork(const Fork&) = delete;
    Fork& operator=(const Fork&) = delete;

   private:
    ForkTrace& trace_;
  };
  class Task {
   public:
    explicit Task(ForkTrace& trace) : trace_(trace) { trace.mark(Kind::kTask); }
    ~Task() { trace_.mark(Kind::kTaskEnd); }
    Task(const Task&) = delete;
    Task& operator=(const Task&) = delete;

   private:
    ForkTrace& trace_;
  };

  const std::vector<Event>& events() const { return events_; }
  void clear() { events_.clear(); }

 private:
  using Clock = std::chrono::steady_clock;

  // What is between tasks of one fork, the trace's own time above all, counts for nothing.
  void end_strand() {
    events_.push_back({Kind::kStrand, std::chrono::duration<double>(Clock::now() - began_).count()});
  }
  void mark(Kind kind) {
    if (kind == Kind::kTaskEnd) end_strand();
    events_.push_back({kind});
    began_ = Clock::now();
  }

  static constinit thread_local ForkTrace* current;

  std::vector<Event> events_;
  Clock::time_point began_{};
};

}  // namespace warmfront
