// SPDX-License-Identifier: Apache-2.0
// A thread's contacts in blocks, against one list of them.
#include "engine/narrow_phase/contact_list.h"

#include <gtest/gtest.h>

#include <random>
#include <utility>
#include <vector>

namespace warmfront {
namespace {

std::vector<Contact> all_of(const ContactList& list) {
  std::vector<Contact> all;
  list.for_blocks([&](std::span<const Contact> block) {
    EXPECT_FALSE(block.empty());
    EXPECT_LE(block.size(), ContactList::kMostOfBlock);
    all.insert(all.end(), block.begin(), block.end());
  });
  EXPECT_EQ(list.size(), all.size());
  EXPECT_EQ(list.empty(), all.empty());
  if (!all.empty()) {
    EXPECT_EQ(list.back(), all.back());
  }
  return all;
}

Contact contact(std::uint32_t n) {
  return {ContactKind::kVertexFace, ContactStatus::kHit, n, n + 1, n * 0.5};
}

TEST(ContactList, HoldsWhatOneListHolds) {
  std::mt19937 random(1);
  ContactList list;
  std::vector<Contact> expected;
  std::uint32_t next = 0;
  for (int round = 0; round < 200; ++round) {
    switch (random() % 4) {
      case 0: {
        const std::uint32_t every = 1 + random() % 5;
        const auto which = [&](const Contact& c) { return c.a % every != 0; };
        list.erase_if(which);
        std::erase_if(expected, which);
        break;
      }
      case 1:
        if (random() % 8 != 0) break;
        list.clear();
        expected.clear();
        break;
      default:
        for (std::uint32_t more = random() % 6000; more > 0; --more) {
          list.push_back(contact(next));
          expected.push_back(contact(next++));
        }
    }
    ASSERT_EQ(all_of(list), expected) << "round " << round;
  }
}

TEST(ContactList, RemovesAll) {
  ContactList list;
  list.erase_if([](const Contact&) { return true; });
  EXPECT_TRUE(list.empty());
  for (std::uint32_t n = 0; n < 5000; ++n) list.push_back(contact(n));
  list.erase_if([](const Contact&) { return true; });
  EXPECT_TRUE(all_of(list).empty());
  list.push_back(contact(7));
  EXPECT_EQ(all_of(list), std::vector<Contact>{contact(7)});
}

// What is in it stays where it is, and what it took before is used again.
TEST(ContactList, GrowsWithoutMoving) {
  ContactList list;
  list.push_back(contact(0));
  const Contact* const first = &list.back();
  for (std::uint32_t n = 1; n < 10000; ++n) list.push_back(contact(n));
  bool is_first = true;
  list.for_blocks([&](std::span<const Contact> block) {
    if (std::exchange(is_first, false)) {
      EXPECT_EQ(block.data(), first);
    }
  });
  const std::size_t bytes = list.memory_bytes();
  EXPECT_GE(bytes, 10000 * sizeof(Contact));
  EXPECT_LE(bytes, (10000 + ContactList::kMostOfBlock) * sizeof(Contact) + 1024);
  list.clear();
  for (std::uint32_t n = 0; n < 10000; ++n) list.push_back(contact(n));
  EXPECT_EQ(list.memory_bytes(), bytes);
}

}  // namespace
}  // namespace warmfront
