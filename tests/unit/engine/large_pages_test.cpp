// SPDX-License-Identifier: Apache-2.0
// Lists that grow ask for large pages, and nothing that is smaller does.
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "engine/parallel/large_pages.h"
#include "engine/parallel/stoppable_loops.h"

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

}  // namespace
}  // namespace warmfront
