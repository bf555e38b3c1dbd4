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

struct Range {
  std::uint64_t begin = 0, end = 0;
};

/// Of a mapping, what is in memory: to read the rest would put it there, and be counted as the process's.
std::vector<Range> present(int pagemap, const Range& mapping) {
  const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  constexpr std::uint64_t kPresent = std::uint64_t{1} << 63, kSwapped = std::uint64_t{1} << 62;  // proc(5)
  std::vector<std::uint64_t> entries((mapping.end - mapping.begin) / page);
  const ssize_t read = ::pread(pagemap, entries.data(), entries.size() * sizeof(std::uint64_t),
                               static_cast<off_t>(mapping.begin / page * sizeof(std::uint64_t)));
  entries.resize(static_cast<std::size_t>(std::max<ssize_t>(read, 0)) / sizeof(std::uint64_t));
  std::vector<Range> ranges;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if ((entries[i] & (kPresent | kSwapped)) == 0) continue;
    const std::uint64_t begin = mapping.begin + i * page;
    if (ranges.empty() || ranges.back().end != begin) ranges.push_back({begin, begin});
    ranges.back().end += page;
  }
  return ranges;
}

/// Where memory that is written may hold data of the process's own.
std::vector<Range> data_of(const std::string& folder, int pagemap) {
  std::vector<Range> ranges;
  std::ifstream maps(folder + "/maps");
  for (std::string line; std::getline(maps, line);) {
    std::istringstream fields(line);
    Range mapping;
    char dash = 0;
    std::string access, offset, device, file;
    std::uint64_t inode = 0;
    fields >> std::hex >> mapping.begin >> dash >> mapping.end >> access >> offset >> device >> std::dec >>
        inode >> file;
    if (!access.starts_with("rw") || inode != 0 || mapping.end - mapping.begin > kMostBytes) continue;
    const std::vector<Range> of_mapping = present(pagemap, mapping);
    ranges.insert(ranges.end(), of_mapping.begin(), of_mapping.end());
  }
  return ranges;
}

}  // namespace

int flip_bits(pid_t process, std::span<const std::uint32_t> words, std::size_t at, std::uint32_t bits) {
  const std::string folder = "/proc/" + std::to_string(process);
  const int memory = ::open((folder + "/mem").c_str(), O_RDWR | O_CLOEXEC);
  const int pagemap = ::open((folder + "/pagemap").c_str(), O_RDONLY | O_CLOEXEC);
  int places = memory < 0 || pagemap < 0 ? -1 : 0;
  const std::vector<Range> ranges = places < 0 ? std::vector<Range>() : data_of(folder, pagemap);
  for (const auto& [begin, end] : ranges) {
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
  for (const int file : {memory, pagemap})
    if (file >= 0) ::close(file);
  return places;
}

}  // namespace warmfront::test
