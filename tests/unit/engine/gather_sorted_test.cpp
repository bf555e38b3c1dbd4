// SPDX-License-Identifier: Apache-2.0
// Contacts of several threads in one order, whatever lists they came in.
#include "engine/narrow_phase/gather_sorted.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <random>
#include <vector>

#include "tests/support/workers.h"

namespace warmfront {
namespace {

// Unique, in order.
std::vector<Contact> drawn(std::mt19937& random, std::size_t count, std::uint32_t vertices,
                           std::uint32_t edges, bool around_one) {
  std::vector<Contact> contacts;
  for (std::size_t i = 0; i < count; ++i) {
    const auto kind = static_cast<ContactKind>(random() % kContactKinds);
    const bool of_edge = kind == ContactKind::kEdgeEdge || kind == ContactKind::kEdgeFace;
    const std::uint32_t most = of_edge ? edges : vertices;
    const std::uint32_t a = around_one && random() % 8 != 0 ? most - 1 : random() % most;
    contacts.push_back({kind, ContactStatus::kHit, a, static_cast<std::uint32_t>(random()), 0.5});
  }
  std::ranges::sort(contacts, in_order);
  const auto same = [](const Contact& x, const Contact& y) { return !in_order(x, y) && !in_order(y, x); };
  contacts.erase(std::unique(contacts.begin(), contacts.end(), same), contacts.end());
  return contacts;
}

TEST(GatherSorted, GivesOneOrder) {
  std::mt19937 random(1);
  for (const std::size_t count : {0U, 1U, 17U, 5000U, 200000U}) {
    for (const std::uint32_t vertices : {1U, 40U, 100000U}) {
      for (const bool around_one : {false, true}) {
        const std::vector<Contact> expected = drawn(random, count, vertices, 3 * vertices, around_one);
        std::vector<std::vector<Contact>> lists(1 + random() % 5);
        std::vector<Contact> shuffled = expected;
        std::ranges::shuffle(shuffled, random);
        for (const Contact& contact : shuffled) lists[random() % lists.size()].push_back(contact);
        const std::vector<std::span<const Contact>> spans(lists.begin(), lists.end());
        UnwrittenList<Contact> found(expected.begin(), expected.begin() + std::min<long>(3, expected.size()));
        std::vector<std::size_t> room{7, 7};
        testing::workers()->run([&] {
          gather_sorted(spans, vertices, {true, true}, 3 * std::size_t{vertices}, found, room, {});
        });
        EXPECT_TRUE(std::ranges::equal(found, expected)) << count << " of " << vertices;
        EXPECT_LE(room.size(), count / 16 + kContactKinds + 2);
      }
    }
  }
}

TEST(GatherSorted, StopsWhenTold) {
  std::mt19937 random(2);
  const std::vector<Contact> contacts = drawn(random, 20000, 1000, 3000, false);
  const std::atomic<bool> stop{true};
  UnwrittenList<Contact> found;
  std::vector<std::size_t> room;
  const std::vector<std::span<const Contact>> lists{contacts};
  testing::workers()->run([&] {
    EXPECT_THROW(gather_sorted(lists, 1000, {true, true}, 3000, found, room, StopSignal(&stop)), Stopped);
  });
}

}  // namespace
}  // namespace warmfront
