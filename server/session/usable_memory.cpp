// SPDX-License-Identifier: Apache-2.0
// Asking the system. Thread safety as stated in the header.
#include "server/session/usable_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace warmfront::server {
namespace {

/// Control groups, version 2: the least `memory.max` from this process's group up to the root; `most` without
/// any. Inside a container the root is the container's own group.
std::size_t group_limit(std::size_t most) {
  std::ifstream membership("/proc/self/cgroup");
  std::string path;
  for (std::string line; std::getline(membership, line);)
    if (line.starts_with("0::")) path = line.substr(3);
  for (;;) {
    std::ifstream file("/sys/fs/cgroup" + path + "/memory.max");
    std::size_t limit = 0;
    if (file >> limit) most = std::min(most, limit);  // "max" is no number: no limit here
    const std::size_t slash = path.rfind('/');
    if (slash == std::string::npos) return most;
    path.resize(slash);
  }
}

std::size_t read() {
  constexpr std::size_t kMiB = std::size_t{1} << 20;
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGE_SIZE);
  const std::size_t machine = pages > 0 && page > 0
                                  ? static_cast<std::size_t>(pages) * static_cast<std::size_t>(page)
                                  : std::size_t{4} << 30;
  return std::max(group_limit(machine) / kMiB, std::size_t{64}) * kMiB;
}

}  // namespace

std::size_t usable_memory_bytes() {
  static const std::size_t bytes = read();
  return bytes;
}

}  // namespace warmfront::server
