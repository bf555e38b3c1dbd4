// SPDX-License-Identifier: Apache-2.0
// /proc/self, by proc(5). Thread safety as stated in the header.
#include "server/observe/process_stats.h"

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>

namespace warmfront::server {
namespace {

// When the machine started, in seconds since the epoch.
double boot_time() {
  std::ifstream file("/proc/stat");
  double seconds = 0;
  for (std::string word; file >> word;)
    if (word == "btime") file >> seconds;
  return seconds;
}

std::uint64_t count_open_files() {
  std::error_code error;
  std::uint64_t files = 0;
  for (auto it = std::filesystem::directory_iterator("/proc/self/fd", error);
       !error && it != std::filesystem::directory_iterator(); it.increment(error))
    ++files;
  return files > 0 ? files - 1 : 0;  // the listing is one itself
}

}  // namespace

ProcessStats process_stats() {
  ProcessStats stats;
  std::ifstream file("/proc/self/stat");
  std::string line;
  std::getline(file, line);
  // The name, field 2, stands in brackets and may hold anything; field 3 follows.
  const std::size_t name_end = line.rfind(')');
  if (name_end != std::string::npos) {
    std::istringstream fields(line.substr(name_end + 1));
    std::string field;
    const double ticks = static_cast<double>(sysconf(_SC_CLK_TCK));
    for (int number = 3; number <= 24 && fields >> field; ++number) {
      if (number == 20) stats.threads = std::stoull(field);
      if (number == 22) stats.start_time_seconds = boot_time() + std::stod(field) / ticks;
      if (number == 23) stats.virtual_bytes = std::stoull(field);
      if (number == 24) stats.resident_bytes = std::stoull(field) * static_cast<std::uint64_t>(getpagesize());
    }
  }
  stats.open_files = count_open_files();
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) == 0) stats.max_files = files.rlim_cur;
  // To the nanosecond, where /proc counts ticks of 10 ms.
  timespec used{};
  if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used) == 0)
    stats.cpu_seconds = static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  return stats;
}

}  // namespace warmfront::server
