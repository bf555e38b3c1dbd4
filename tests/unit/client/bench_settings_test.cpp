// SPDX-License-Identifier: Apache-2.0
// The settings that `warmfront bench` compares, and its detection of differing answers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "client/cli/bench/run.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;

BenchRow row(std::string name, Tier tier, std::string hash) {
  BenchRow row;
  row.setting = {std::move(name), {.tier = tier}, 1};
  row.hash = std::move(hash);
  return row;
}

TEST(BenchSettings, AnswersOfOneTierMustAgree) {
  std::vector<BenchRow> rows{row("default", Tier::kCertified, "a1"), row("leaf 1", Tier::kCertified, "a1"),
                             row("tier fast", Tier::kFast, "b2")};
  EXPECT_EQ(disagreement(rows), std::nullopt);
  rows.push_back(row("front none", Tier::kCertified, "c3"));
  const auto sentence = disagreement(rows);
  ASSERT_TRUE(sentence.has_value());
  for (const char* part : {"\"default\"", "a1", "\"front none\"", "c3"})
    EXPECT_THAT(*sentence, HasSubstr(part));
}

TEST(BenchSettings, AblationsDifferFromTheDefaultInOneThing) {
  constexpr std::array kThreads{2, 4};
  const ColliderOptions base{
      .tier = Tier::kExact, .front = FrontMode::kPaper, .bounds = BoundsKind::kKDop18, .leaf_size = 2};
  const auto settings = bench_settings(
      base, kThreads,
      {.front = true, .cones = true, .bounds = true, .found = true, .leaf = true, .tier = true});
  std::vector<std::string> names;
  for (const BenchSetting& setting : settings) names.push_back(setting.name);
  EXPECT_THAT(names, ::testing::ElementsAre("default", "default", "front none", "front warm",
                                            "front warm, lazy", "cones on", "bounds aabb", "nothing found",
                                            "parts not separated", "leaf 1", "leaf 4", "leaf 8", "leaf 16",
                                            "leaf 32", "leaf 64", "tier fast", "tier certified"));
  EXPECT_EQ(settings[1].threads, 4);
  for (std::size_t i = 2; i < settings.size(); ++i) {
    const ColliderOptions& o = settings[i].options;
    EXPECT_EQ(settings[i].threads, 2);
    EXPECT_EQ((o.tier != base.tier) + (o.front != base.front) + (o.bounds != base.bounds) +
                  (o.normal_cones != base.normal_cones) + (o.separate_parts != base.separate_parts) +
                  (o.leaf_size != base.leaf_size),
              1)
        << settings[i].name;
  }
}

}  // namespace
}  // namespace warmfront::client
