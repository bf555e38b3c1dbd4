// SPDX-License-Identifier: Apache-2.0
#include "server/transport/yield_to_steps.h"

#include <sched.h>
#include <unistd.h>

namespace warmfront::server {

void yield_to_steps(bool to_steps) {
  // The first thread's policy is as the daemon was started; a thread's own may be that of one of gRPC's which
  // started it, as it was then.
  thread_local const bool free_to_choose = sched_getscheduler(getpid()) == SCHED_OTHER;
  thread_local bool gives = sched_getscheduler(0) == SCHED_BATCH;
  if (to_steps == gives || !free_to_choose) return;
  const sched_param no_priority{};
  static_cast<void>(sched_setscheduler(0, to_steps ? SCHED_BATCH : SCHED_OTHER, &no_priority));
  gives = to_steps;
}

}  // namespace warmfront::server
