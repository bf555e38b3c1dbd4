// SPDX-License-Identifier: Apache-2.0
// What a load asks in turn.
#include "client/cli/load/mix.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace warmfront::client::load {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using enum Asked;

std::vector<Asked> cycle(const std::vector<std::string>& items) {
  return parse_mix(items).value().cycle;
}

TEST(LoadMix, QuestionsComeBeforeTheCommitThatTakesThem) {
  EXPECT_THAT(cycle({"trial=3", "commit=1"}), ElementsAre(kTrial, kTrial, kTrial, kCommit));
  EXPECT_THAT(cycle({"commit=1", "max_step=1", "trial=2"}), ElementsAre(kMaxStep, kTrial, kTrial, kCommit));
  EXPECT_THAT(cycle({"trial=3", "commit=2"}), ElementsAre(kTrial, kCommit, kTrial, kTrial, kCommit));
  EXPECT_THAT(cycle({"step=2", "trial=1", "commit=1"}), ElementsAre(kTrial, kCommit, kStep, kStep));
  EXPECT_THAT(cycle({"step=2", "trial=4"}), ElementsAre(kTrial, kTrial, kStep, kTrial, kTrial, kStep));
  EXPECT_THAT(cycle({"max_step=2"}), ElementsAre(kMaxStep, kMaxStep));
  EXPECT_THAT(cycle({"step=1"}), ElementsAre(kStep));
  EXPECT_THAT(cycle({"proximity=2", "max_step=2", "commit=2", "intersections=1"}),
              ElementsAre(kProximity, kMaxStep, kCommit, kProximity, kIntersections, kMaxStep, kCommit));
  EXPECT_THAT(cycle({"proximity=1"}), ElementsAre(kProximity));
}

TEST(LoadMix, EveryCycleHasTheCountsAndAQuestionForEachCommit) {
  for (std::size_t step = 0; step < 4; ++step) {
    for (std::size_t trial = 0; trial < 5; ++trial) {
      for (std::size_t max_step = 0; max_step < 4; ++max_step) {
        for (std::size_t commit = 0; commit <= trial + max_step; ++commit) {
          const std::array<std::size_t, kAskedKinds> counts{step, trial, commit, max_step, trial, step};
          std::vector<std::string> items;
          for (std::size_t k = 0; k < kAskedKinds; ++k)
            if (counts[k] > 0) items.push_back(kAskedNames[k] + ("=" + std::to_string(counts[k])));
          if (items.empty()) continue;
          const Mix mix = parse_mix(items).value();
          bool stands = false;
          for (const Asked asked : mix.cycle) {
            EXPECT_TRUE(asked != kCommit || stands) << mix.text;
            const bool of_state =
                asked == kProximity || asked == kIntersections;  // the last trial still stands
            if (!of_state) stands = !moves(asked);
          }
          for (std::size_t k = 0; k < kAskedKinds; ++k)
            EXPECT_EQ(std::ranges::count(mix.cycle, static_cast<Asked>(k)), static_cast<long>(counts[k]))
                << mix.text;
          EXPECT_EQ(mix.at(mix.cycle.size()), mix.cycle.front());
        }
      }
    }
  }
}

TEST(LoadMix, SaysWhatIsWrong) {
  for (const char* item : {"", "trial", "trial=", "trial=0", "trial=-1", "trial=1.5", "trial=1001", "look=1",
                           "=1", "trial=x", "trial=1 "}) {
    const auto refused = parse_mix(std::vector<std::string>{item});
    ASSERT_FALSE(refused.ok()) << item;
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(refused.error().message, HasSubstr(std::string("'") + item + "': "));
    EXPECT_THAT(refused.error().message,
                HasSubstr("one of step, trial, commit, max_step, proximity, intersections"));
  }
  const auto message = [](const std::vector<std::string>& items) { return parse_mix(items).error().message; };
  EXPECT_THAT(message({"trial=1", "trial=2"}), HasSubstr("given twice"));
  EXPECT_THAT(message({"commit=1"}), HasSubstr("of which there are 0"));
  EXPECT_THAT(message({"commit=3", "trial=1", "max_step=1"}), HasSubstr("of which there are 2"));
}

TEST(LoadMix, WithoutOneAllAreSteps) {
  const Mix none = parse_mix({}).value();
  EXPECT_TRUE(none.text.empty());
  EXPECT_EQ(none.at(0), kStep);
  EXPECT_EQ(none.at(7), kStep);
}

}  // namespace
}  // namespace warmfront::client::load
