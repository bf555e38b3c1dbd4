// SPDX-License-Identifier: Apache-2.0
// Asking the system. Thread safety as stated in the header.
#include "server/session/usable_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace warmfront::server {
namespace {

/// The least of the files `name` from `path` up to `folder`. Inside a container `folder` is the container's
/// own group, while `path` may be what the group is called outside: what is not there limits nothing.
std::size_t least_limit(const std::string& folder, std::string path, const char* name, std::size_t most) {
  for (;;) {
    std::ifstream file(folder + path + "/" + name);
    std::size_t limit = 0;
    // No limit is "max", which is no number, in version 2, and a number beyond every machine in version 1.
    if (file >> limit) most = std::min(most, limit);
    const std::size_t slash = path.rfind('/');
    if (slash == std::string::npos) return most;
    path.resize(slash);
  }
}

/// Whether "cpu,memory" names the memory controller.
bool has_memory(const std::string& controllers) {
  return ("," + controllers + ",").find(",memory,") != std::string::npos;
}

std::size_t read() {
  constexpr std::size_t kMiB = std::size_t{1} << 20;
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGE_SIZE);
  const std::size_t machine = pages > 0 && page > 0
                                  ? static_cast<std::size_t>(pages) * static_cast<std::size_t>(page)
                                  : std::size_t{4} << 30;
  return std::max(control_group_limit(machine) / kMiB, std::size_t{64}) * kMiB;
}

}  // namespace

std::size_t control_group_limit(std::size_t most, const std::string& root) {
  const std::string groups = root + "/sys/fs/cgroup";
  std::ifstream membership(root + "/proc/self/cgroup");
  // Lines are NUMBER:CONTROLLERS:PATH (cgroups(7)), without controllers in version 2. A machine may have
  // both.
  for (std::string line; std::getline(membership, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1),
                      path = line.substr(second + 1);
    if (controllers.empty())
      most = least_limit(groups, path, "memory.max", most);
    else if (has_memory(controllers))
      most = least_limit(groups + "/memory", path, "memory.limit_in_bytes", most);
  }
  return most;
}

std::size_t usable_memory_bytes() {
  static const std::size_t bytes = read();
  return bytes;
}

}  // namespace warmfront::server
