// SPDX-License-Identifier: Apache-2.0
// Through /proc/PID/maps and mem, which a parent may write. Thread safety as stated in the header.
#include "tests/faults/process_memory.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

namespace warmfront::test {
namespace {

/// A sanitizer's shadow is as large as the address space, and holds no data.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

}  // namespace

int flip_bits(pid_t process, std::span<const std::uint32_t> words, std::size_t at, std::uint32_t bits) {
  const std::string folder = "/proc/" + std::to_string(process);
  const int memory = ::open((folder + "/mem").c_str(), O_RDWR | O_CLOEXEC);
  if (memory < 0) return -1;
  int places = 0;
  std::ifstream maps(folder + "/maps");
  for (std::string line; std::getline(maps, line);) {
    std::istringstream fields(line);
    std::uint64_t begin = 0, end = 0;
    char dash = 0;
    std::string access, offset, device, file;
    std::uint64_t inode = 0;
    fields >> std::hex >> begin >> dash >> end >> access >> offset >> device >> std::dec >> inode >> file;
    if (!access.starts_with("rw") || inode != 0 || end - begin > kMostBytes) continue;
    std::vector<std::uint32_t> held((end - begin) / sizeof(std::uint32_t));
    const ssize_t read =
        ::pread(memory, held.data(), held.size() * sizeof(std::uint32_t), static_cast<off_t>(begin));
    if (read <= 0) continue;
    held.resize(static_cast<std::size_t>(read) / sizeof(std::uint32_t));
    const std::boyer_moore_horspool_searcher searcher(words.begin(), words.end());
    for (auto found = held.begin(); (found = std::search(found, held.end(), searcher)) != held.end();
         ++found) {
      const std::uint32_t changed = words[at] ^ bits;
      const auto where = begin + (static_cast<std::uint64_t>(found - held.begin()) + at) * sizeof changed;
      if (::pwrite(memory, &changed, sizeof changed, static_cast<off_t>(where)) != sizeof changed)
        places = -1;
      if (places < 0) break;
      ++places;
    }
    if (places < 0) break;
  }
  ::close(memory);
  return places;
}

}  // namespace warmfront::test
