// SPDX-License-Identifier: Apache-2.0
// A thread of its own does what no signal handler may. Thread safety as stated in the header.
#include "client/cli/interrupt.h"

#include <semaphore.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "client/io/staged_file.h"

namespace warmfront::client {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP, SIGPIPE};

sem_t signalled;
std::atomic<int> first_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);

void heed(int number) {
  const int before = errno;
  int none = 0;
  if (first_signal.compare_exchange_strong(none, number)) sem_post(&signalled);
  errno = before;
}

/// Between two rows, for good: whoever prints the next one waits.
void flush_rows() {
  constexpr std::chrono::seconds kMostWait{1};
  constexpr std::chrono::milliseconds kBetween{1};
  const auto until = std::chrono::steady_clock::now() + kMostWait;
  while (ftrylockfile(stdout) != 0) {
    if (std::chrono::steady_clock::now() > until) return;  // nobody reads what is being written
    std::this_thread::sleep_for(kBetween);
  }
  static_cast<void>(fflush(stdout));
}

void say(int number, const std::vector<std::string>& not_written) {
  std::string line = std::string("warmfront: ended by SIG") + sigabbrev_np(number);
  for (const std::string& file : not_written) line += "; not written: " + file;
  static_cast<void>(std::fprintf(stderr, "%s\n", line.c_str()));
}

void end_when_signalled() {
  while (sem_wait(&signalled) != 0) {
  }
  const int number = first_signal.load();
  const std::vector<std::string> not_written = StagedFile::remove_all();
  if (number != SIGPIPE) {  // nobody reads them then
    flush_rows();
    say(number, not_written);
  }
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  sigaction(number, &action, nullptr);
  raise(number);
}

}  // namespace

void end_tidily() {
  if (sem_init(&signalled, 0, 0) != 0) return;
  try {
    std::thread(end_when_signalled).detach();
  } catch (const std::system_error&) {
    return;  // signals end the process as ever
  }
  for (const int number : kSignals) {
    struct sigaction before {};
    if (sigaction(number, nullptr, &before) != 0 || before.sa_handler == SIG_IGN) continue;
    struct sigaction action {};
    action.sa_handler = heed;
    action.sa_flags = SA_RESTART;
    // Somebody who asks a second time waits no more. A pipe that nobody reads asks at each write.
    if (number != SIGPIPE) action.sa_flags |= static_cast<int>(SA_RESETHAND);
    sigaction(number, &action, nullptr);
  }
}

WholeRow::WholeRow() {
  flockfile(stdout);
}
WholeRow::~WholeRow() {
  funlockfile(stdout);
}

}  // namespace warmfront::client
