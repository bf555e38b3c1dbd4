// SPDX-License-Identifier: Apache-2.0
// Steps on the threads that receive packets: on how many, and who receives while they take long.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <latch>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "server/process/reserve_threads.h"
#include "server/session/runner.h"

namespace warmfront::test {
namespace {

using server::Guest;
using server::Lane;
using server::ReserveThreads;
using server::Runner;
using server::Share;

constexpr bool kBrief = true, kNotBrief = false;

class PacketGuests : public ::testing::Test {
 protected:
  /// Whether a task of that share has room, beside which `inside` runs.
  bool runs(
      const std::shared_ptr<Share>& share, bool brief, const std::function<void()>& inside = [] {}) {
    Runner::Tasks one;
    one.emplace_back(
        [&] {
          inside();
          return std::optional<Lane>();
        },
        share);
    return runner_.run_here(one, Lane::kShort, Guest::kPacket, brief);
  }
  /// How many guests there may be at once.
  int room(const std::shared_ptr<Share>& share, bool brief) {
    int count = 0;
    const std::function<void()> one_more = [&] {
      ++count;
      runs(share, brief, one_more);
    };
    runs(share, brief, one_more);
    return count;
  }

  std::chrono::steady_clock::time_point now_{std::chrono::seconds(1000)};
  Runner runner_{1, {0, 3}, std::nullopt, [this] { return now_; }};
  std::shared_ptr<Share> ours_ = std::make_shared<Share>(1), others_ = std::make_shared<Share>(1);
};

TEST_F(PacketGuests, OneThreadReceivesBesideStepsThatAreNotBrief) {
  EXPECT_EQ(room(ours_, kBrief), 3);
  EXPECT_EQ(room(ours_, kNotBrief), 2);
  EXPECT_EQ(room(ours_, kBrief), 3);
}

TEST_F(PacketGuests, OneThreadQueuesByShareWhileOthersAreAbout) {
  EXPECT_EQ(room(ours_, kBrief), 3);
  EXPECT_EQ(room(others_, kBrief), 2);
  EXPECT_EQ(room(ours_, kBrief), 2);
  now_ += std::chrono::milliseconds(999);
  EXPECT_EQ(room(ours_, kBrief), 2);
  now_ += std::chrono::milliseconds(2);
  EXPECT_EQ(room(ours_, kBrief), 3);
}

/// Turns, each of which holds its thread until go_on().
class Turns {
 public:
  bool turn(ReserveThreads::Hand& hand, std::chrono::milliseconds most) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, most, [&] { return waiting_ > 0 || ends_; });
    if (ends_) return false;
    if (waiting_ == 0) return true;
    --waiting_;
    ++taken_;
    changed_.notify_all();
    hand.begins();
    changed_.wait(lock, [&] { return goes_on_ || ends_; });
    hand.ends();
    return true;
  }
  void add(int count) {
    const std::lock_guard lock(mutex_);
    waiting_ += count;
    changed_.notify_all();
  }
  void wait_until_taken(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return taken_ >= count; });
  }
  void go_on() {
    const std::lock_guard lock(mutex_);
    goes_on_ = true;
    changed_.notify_all();
  }
  void end() {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    changed_.notify_all();
  }
  int taken() {
    const std::lock_guard lock(mutex_);
    return taken_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int waiting_ = 0, taken_ = 0;
  bool goes_on_ = false, ends_ = false;
};

TEST(ReserveThreads, TheReserveJoinsInWhileAllOthersTakeLong) {
  Turns turns;
  ReserveThreads threads(2, [&](ReserveThreads::Hand& hand, auto most) { return turns.turn(hand, most); });
  turns.add(1);
  threads.begin();
  turns.wait_until_taken(1);
  turns.add(1);
  turns.wait_until_taken(2);
  turns.add(1);
  turns.wait_until_taken(3);  // it hangs without a reserve
  turns.go_on();
  turns.add(5);
  turns.wait_until_taken(8);
  turns.end();
  threads.join();
  EXPECT_EQ(turns.taken(), 8);
}

TEST(ReserveThreads, EndWhileOthersAreAtWorkAndTwice) {
  Turns turns;
  ReserveThreads threads(1, [&](ReserveThreads::Hand& hand, auto most) { return turns.turn(hand, most); });
  threads.begin();
  turns.add(1);
  turns.wait_until_taken(1);
  turns.end();
  threads.join();
  threads.join();
}

}  // namespace
}  // namespace warmfront::test
