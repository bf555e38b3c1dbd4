// SPDX-License-Identifier: Apache-2.0
// Lists that grow ask for large pages, and nothing that is smaller does; some leave new memory to who writes
// it.
#include "engine/parallel/large_pages.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "engine/parallel/stoppable_loops.h"
#include "engine/parallel/unwritten_list.h"

namespace warmfront {
namespace {

/// What the system says of the mapping that holds the address: a line of flags of two letters each.
std::string flags_of(const void* address) {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  std::ifstream maps("/proc/self/smaps");
  bool within = false;
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t first = 0, end = 0;
    char dash = 0;
    if (std::istringstream range(line); range >> std::hex >> first >> dash >> end && dash == '-')
      within = first <= at && at < end;
    if (within && line.starts_with("VmFlags:")) return line + " ";
  }
  return {};
}

bool system_has_large_pages() {
  std::ifstream enabled("/sys/kernel/mm/transparent_hugepage/enabled");
  return enabled.good();
}

TEST(LargePages, AreAskedForByListsThatHaveWholeOnes) {
  if (!system_has_large_pages()) GTEST_SKIP() << "this system has no transparent huge pages";
  constexpr std::size_t kPage = std::size_t{1} << 21;
  std::vector<std::uint64_t> list;
  reserve(list, 4 * kPage / sizeof(std::uint64_t), {});
  EXPECT_NE(flags_of(reinterpret_cast<const char*>(list.data()) + 2 * kPage).find(" hg "), std::string::npos);
  lengthen(list, list.capacity(), std::uint64_t{7}, {});
  EXPECT_EQ(list.back(), 7u);
}

TEST(LargePages, OfWhatHasNoneNothingIsAsked) {
  prefer_large_pages(nullptr, 0);
  constexpr std::size_t kBytes = std::size_t{1} << 20;
  void* const bytes = ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(bytes, MAP_FAILED);
  prefer_large_pages(bytes, kBytes);
  EXPECT_EQ(flags_of(bytes).find(" hg "), std::string::npos);
  ::munmap(bytes, kBytes);
}

/// Pages of 4 KiB that are in memory, of those that lie in these bytes as a whole.
std::size_t resident_pages(const void* begin, std::size_t bytes) {
  constexpr std::uintptr_t kPage = 4096;
  const std::uintptr_t first = (reinterpret_cast<std::uintptr_t>(begin) + kPage - 1) / kPage * kPage;
  std::vector<unsigned char> in_memory(bytes / kPage - 1);
  EXPECT_EQ(::mincore(reinterpret_cast<void*>(first), kPage * in_memory.size(), in_memory.data()), 0);
  return static_cast<std::size_t>(std::ranges::count_if(in_memory, [](unsigned char in) { return in & 1; }));
}

TEST(UnwrittenLists, AreMappedByWhoWritesThem) {
  constexpr std::size_t kPages = 16384;
  constexpr std::size_t kBytes = 4096 * kPages;
  UnwrittenList<std::uint64_t> list;
  make_room(list, kBytes / sizeof(std::uint64_t));
  EXPECT_LT(resident_pages(list.data(), kBytes), kPages / 8);
  std::ranges::fill(list, 7U);
  EXPECT_GT(resident_pages(list.data(), kBytes), kPages / 8 * 7);
  const std::uint64_t* const before = list.data();
  make_room(list, 5);
  EXPECT_EQ(list.size(), 5U);
  make_room(list, kBytes / sizeof(std::uint64_t));
  EXPECT_EQ(list.data(), before) << "what has room gets no other";
}

}  // namespace
}  // namespace warmfront
