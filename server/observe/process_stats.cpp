// SPDX-License-Identifier: Apache-2.0
// /proc/self, by proc(5). Thread safety as stated in the header.
#include "server/observe/process_stats.h"

#include <dirent.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

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

std::uint64_t most_open_files() {
  rlimit files{};
  return getrlimit(RLIMIT_NOFILE, &files) == 0 ? files.rlim_cur : 0;
}

std::uint64_t count_open_files() {
  const std::unique_ptr<DIR, int (*)(DIR*)> listing(opendir("/proc/self/fd"), closedir);
  if (listing == nullptr) return errno == EMFILE ? most_open_files() : 0;  // none is free: all are open
  std::uint64_t files = 0;
  while (const dirent* entry = readdir(listing.get())) files += entry->d_name[0] != '.';
  return files - 1;  // the listing is one itself
}

}  // namespace

ProcessStats process_stats() {
  ProcessStats stats;
  stats.open_files = count_open_files();
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
  stats.max_files = most_open_files();
  // To the nanosecond, where /proc counts ticks of 10 ms.
  timespec used{};
  if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used) == 0)
    stats.cpu_seconds = static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  return stats;
}

}  // namespace warmfront::server
