// SPDX-License-Identifier: Apache-2.0
// The hash of contacts tells order and bits apart, and may be made part by part.
#include "engine/contact_hash.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <random>

namespace warmfront {
namespace {

TEST(ContactHash, TellsOrderAndBitsApart) {
  const auto hash = [](std::initializer_list<double> tois) {
    ContactHash h;
    h.begin_step(tois.size());
    for (const double toi : tois) h.add(ContactKind::kEdgeEdge, ContactStatus::kHit, {1, 2, 3, 4}, toi);
    return h.hex();
  };
  EXPECT_EQ(hash({0.1, 0.2}), hash({0.1, 0.2}));
  EXPECT_NE(hash({0.1, 0.2}), hash({0.2, 0.1}));
  EXPECT_NE(hash({0.0}), hash({-0.0}));
  EXPECT_EQ(hash({}).size(), 16U);
}

// Parts that know nothing of what came before them make the hash of the whole, however it is cut, also
// through their text.
TEST(ContactHash, IsMadeOfParts) {
  std::mt19937_64 draw(7);
  for (int round = 0; round < 50; ++round) {
    ContactHash whole;
    std::uint64_t value = whole.value();
    ContactHashPart all;
    while (draw() % 6 != 0) {
      ContactHashPart part;
      for (std::uint64_t steps = draw() % 4; steps > 0; --steps) {
        const std::uint64_t contacts = draw() % 5;
        whole.begin_step(contacts);
        part.begin_step(contacts);
        for (std::uint64_t i = 0; i < contacts; ++i) {
          // Large and small numbers, as their bytes that are 0 are mixed in another way.
          const auto vertex = [&] { return static_cast<std::uint32_t>(draw() >> (draw() % 33 + 31)); };
          const std::array<std::uint32_t, 4> vertices{vertex(), vertex(), vertex(), vertex()};
          const double toi = draw() % 3 == 0 ? 0.0 : std::ldexp(static_cast<double>(draw() >> 11), -53);
          const auto kind = static_cast<ContactKind>(draw() % kContactKinds);
          whole.add(kind, ContactStatus::kPossible, vertices, toi);
          part.add(kind, ContactStatus::kPossible, vertices, toi);
        }
      }
      const auto read = ContactHashPart::parse(part.text());
      ASSERT_TRUE(read.has_value());
      value = read->after(value);
      all.append(part);
      ASSERT_EQ(value, whole.value());
    }
    EXPECT_EQ(all.after(ContactHash().value()), whole.value());
    EXPECT_EQ(ContactHash(value).hex(), whole.hex());
  }
  const std::string text = ContactHashPart().text();
  EXPECT_FALSE(ContactHashPart::parse(text.substr(1)));
  EXPECT_FALSE(ContactHashPart::parse("G" + text.substr(1)));
  EXPECT_FALSE(ContactHashPart::parse(""));
}

}  // namespace
}  // namespace warmfront
