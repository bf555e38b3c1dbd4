// SPDX-License-Identifier: Apache-2.0
// What a system takes for itself when clients ask a daemon on the same machine: threads that ask on schedule,
// and a process of as many threads as there are cores that answers each after it has read so much memory. No
// engine and no protocol: a daemon's latencies, and its time beside the engine, cannot be less than these.
// Prints one line.
//   echo_bench [CLIENTS [A_SECOND [KILOBYTES [SECONDS]]]]
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <numeric>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

struct Plan {
  int clients = 64;
  double a_second = 4000;
  std::size_t kilobytes = 400;
  double seconds = 6;
};

/// A client's two ends of a socket of packets.
struct Ends {
  std::array<int, 2> of{};
  int client() const { return of[0]; }
  int daemon() const { return of[1]; }
};

/// Armed for one packet at a time, so that one thread at most answers it.
void arm(int poll, int operation, const std::vector<Ends>& ends, std::uint32_t which) {
  epoll_event event{};
  event.events = EPOLLIN | EPOLLONESHOT;
  event.data.u32 = which;
  if (::epoll_ctl(poll, operation, ends[which].daemon(), &event) != 0) std::abort();
}

/// Until it is killed.
[[noreturn]] void answer_all(const Plan& plan, const std::vector<Ends>& ends) {
  const int poll = ::epoll_create1(0);
  for (std::uint32_t i = 0; i < ends.size(); ++i) arm(poll, EPOLL_CTL_ADD, ends, i);
  // Each client's own, as a session's hierarchy is.
  std::vector<std::vector<std::uint64_t>> memory(ends.size(),
                                                 std::vector<std::uint64_t>(plan.kilobytes * 128, 1));
  const auto answer = [&] {
    for (;;) {
      epoll_event event{};
      if (::epoll_wait(poll, &event, 1, -1) != 1) continue;
      const std::uint32_t which = event.data.u32;
      std::uint64_t sum = 0;
      if (::recv(ends[which].daemon(), &sum, sizeof sum, 0) <= 0) std::abort();
      sum = std::accumulate(memory[which].begin(), memory[which].end(), sum);
      if (::send(ends[which].daemon(), &sum, sizeof sum, 0) <= 0) std::abort();
      arm(poll, EPOLL_CTL_MOD, ends, which);
    }
  };
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < std::max(2U, std::thread::hardware_concurrency()); ++i)
    threads.emplace_back(answer);
  for (std::thread& thread : threads) thread.join();
  std::abort();
}

/// Milliseconds from when each question was due, evenly spread, to its answer; those of the first second are
/// left out.
std::vector<double> ask_all(const Plan& plan, const std::vector<Ends>& ends) {
  std::vector<double> all;
  std::mutex mutex;
  const Clock::time_point start = Clock::now() + std::chrono::milliseconds(100);
  const auto ask = [&](std::size_t which) {
    std::vector<double> own;
    for (double k = static_cast<double>(which) / plan.clients;; ++k) {
      const double at = k * plan.clients / plan.a_second;
      if (at > plan.seconds) break;
      const auto due = start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(at));
      std::this_thread::sleep_until(due);
      std::uint64_t number = 0;
      if (::send(ends[which].client(), &number, sizeof number, 0) <= 0 ||
          ::recv(ends[which].client(), &number, sizeof number, 0) <= 0)
        std::abort();
      if (at >= 1) own.push_back(Milliseconds(Clock::now() - due).count());
    }
    const std::lock_guard lock(mutex);
    all.insert(all.end(), own.begin(), own.end());
  };
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < ends.size(); ++i) threads.emplace_back(ask, i);
  for (std::thread& thread : threads) thread.join();
  std::ranges::sort(all);
  return all;
}

double microseconds(const timeval& time) {
  return 1e6 * static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec);
}

}  // namespace

int main(int argc, char** argv) {
  Plan plan;
  if (argc > 1) plan.clients = std::max(1, std::atoi(argv[1]));
  if (argc > 2) plan.a_second = std::max(1.0, std::atof(argv[2]));
  if (argc > 3) plan.kilobytes = static_cast<std::size_t>(std::max(0, std::atoi(argv[3])));
  if (argc > 4) plan.seconds = std::max(1.5, std::atof(argv[4]));
  std::vector<Ends> ends(static_cast<std::size_t>(plan.clients));
  for (Ends& one : ends)
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, one.of.data()) != 0) std::abort();
  const pid_t daemon = ::fork();
  if (daemon == 0) answer_all(plan, ends);
  if (daemon < 0) std::abort();
  const std::vector<double> ms = ask_all(plan, ends);
  ::kill(daemon, SIGKILL);
  rusage used{};
  int status = 0;
  ::wait4(daemon, &status, 0, &used);
  const auto quantile = [&](double q) {
    return ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1))];
  };
  const double questions = plan.a_second * plan.seconds;
  std::printf(
      "%d clients, %g a second, %zu kB read for each: p50 %.3f ms, p90 %.3f, p99 %.3f (%.1f times p50); a "
      "question takes %.0f us of the program and %.0f us of the system\n",
      plan.clients, plan.a_second, plan.kilobytes, quantile(0.5), quantile(0.9), quantile(0.99),
      quantile(0.99) / quantile(0.5), microseconds(used.ru_utime) / questions,
      microseconds(used.ru_stime) / questions);
}
