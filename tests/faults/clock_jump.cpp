// SPDX-License-Identifier: Apache-2.0
// Preloaded into the daemon: its wall clock jumps back and forth by an hour, four times a second. Affects
// everything that measures time by the wall clock. Thread-safe.
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const long result = syscall(SYS_clock_gettime, clock, now);
  if (result == 0 && clock == CLOCK_REALTIME) {
    timespec steady{};
    syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &steady);
    const long quarter = steady.tv_sec * 4 + steady.tv_nsec / 250'000'000;
    now->tv_sec += quarter % 3 == 1 ? 3600 : quarter % 3 == 2 ? -3600 : 0;
  }
  return static_cast<int>(result);
}
