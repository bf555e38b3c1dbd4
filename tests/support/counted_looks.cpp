// SPDX-License-Identifier: Apache-2.0
#include "tests/support/counted_looks.h"

#include "engine/stop.h"

namespace warmfront {
namespace testing {
namespace {

// The looks left before the one that stops; negative: none does.
std::atomic<long> looks_left{-1};
std::atomic<bool> stopped{false};
std::atomic<bool> found{false};  // there was such a look
std::atomic<long> looks{0};

}  // namespace

CountedLooks::CountedLooks(long n) {
  stopped = found = false;
  looks = 0;
  looks_left = n;
}
CountedLooks::~CountedLooks() {
  looks_left = -1;
  stopped = false;
}

const std::atomic<bool>* CountedLooks::flag() {
  return &stopped;
}
bool CountedLooks::met() {
  return found;
}
long CountedLooks::count() {
  return looks;
}

}  // namespace testing

// In place of the engine's.
void StopSignal::look() const {
  if (flag_ == testing::CountedLooks::flag()) ++testing::looks;
  if (flag_ == testing::CountedLooks::flag() && testing::looks_left.load() >= 0 &&
      testing::looks_left.fetch_sub(1) == 0)
    testing::stopped = testing::found = true;
  if (flag_->load()) throw Stopped{};
}

}  // namespace warmfront
