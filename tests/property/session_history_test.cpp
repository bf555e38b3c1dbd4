// SPDX-License-Identifier: Apache-2.0
// Histories of a collider: all operations, in any order, valid and invalid, cancelled, out of memory and over
// limits. The model is the sequence of accepted operations; each answer is compared with brute force.
// WARMFRONT_HISTORIES: number of histories (1,000); RC_PARAMS="seed=..." repeats a run, and a failure is
// reported as the shortest failing history found.
#include "tests/property/session_history.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <vector>

#include "tests/property/session_history_draws.h"

namespace warmfront::testing {
namespace {

// Runs `histories` histories on `threads` threads.
void check_histories(const char* name, int threads, int histories,
                     History::Scenes scenes = History::Scenes::kSmall) {
  const auto workers = std::make_shared<Workers>(threads);
  rc::detail::TestMetadata metadata;
  metadata.id = metadata.description = name;
  rc::detail::TestParams params = rc::detail::configuration().testParams;
  if (params.maxSuccess == rc::detail::TestParams{}.maxSuccess) params.maxSuccess = histories;
  long commands = 0;
  const auto result = rc::detail::checkTestable(
      [&] {
        const auto seed = *rc::gen::inRange<std::uint32_t>(0, 1U << 30);
        const auto all = *rc::gen::resize(20, rc::gen::container<std::vector<Command>>(any_command()));
        History history(seed, workers, scenes);
        for (const Command& command : all) {
          ++commands;
          history.take(command);
        }
        history.end();
      },
      metadata, params);
  std::ostringstream told;
  rc::detail::printResultMessage(result, told);
  EXPECT_TRUE(result.template is<rc::detail::SuccessResult>()) << told.str();
  std::printf("%s; %ld commands\n", told.str().c_str(), commands);
}

int histories() {
  const char* text = std::getenv("WARMFRONT_HISTORIES");
  return text == nullptr ? 1000 : std::atoi(text);
}

TEST(SessionHistory, IsWhatItsAcceptedOperationsMakeOfIt) {
  check_histories("one thread", 1, histories());
}

// Which allocation fails then depends on the threads; what follows does not.
TEST(SessionHistory, IsThatOnTwoThreads) {
  check_histories("two threads", 2, histories() / 4);
}

TEST(SessionHistory, OfLargeScenesIsThatOnTwoThreads) {
  check_histories("large scenes", 2, histories() / 20, History::Scenes::kLarge);
}

}  // namespace
}  // namespace warmfront::testing
