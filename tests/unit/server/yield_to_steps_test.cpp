// SPDX-License-Identifier: Apache-2.0
// How threads that carry messages are scheduled beside threads that compute.
#include "server/transport/yield_to_steps.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <thread>

namespace warmfront::server {
namespace {

/// Of the first thread and this.
bool set_policy(int policy) {
  const sched_param no_priority{};
  return sched_setscheduler(getpid(), policy, &no_priority) == 0 &&
         sched_setscheduler(0, policy, &no_priority) == 0;
}

TEST(GiveWayTest, AThreadWaitsForStepsWhileToldTo) {
  std::thread([] {
    if (!set_policy(SCHED_BATCH) || !set_policy(SCHED_OTHER)) GTEST_SKIP() << "the system forbids it";
    yield_to_steps(false);
    EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER);
    for (int i = 0; i < 2; ++i) {
      yield_to_steps(true);
      EXPECT_EQ(sched_getscheduler(0), SCHED_BATCH);
      std::thread([] {
        EXPECT_EQ(sched_getscheduler(0), SCHED_BATCH)
            << "inherited, as by a thread that one of gRPC's starts";
        yield_to_steps(false);
        EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER);
      }).join();
      yield_to_steps(false);
      EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER);
    }
  }).join();
}

TEST(GiveWayTest, TheOperatorsChoiceIsKept) {
  std::thread([] {
    if (!set_policy(SCHED_BATCH)) GTEST_SKIP() << "the system forbids it";
    for (const bool to_steps : {false, true, false}) {
      yield_to_steps(to_steps);
      EXPECT_EQ(sched_getscheduler(0), SCHED_BATCH);
    }
    EXPECT_TRUE(set_policy(SCHED_OTHER));
  }).join();
}

}  // namespace
}  // namespace warmfront::server
