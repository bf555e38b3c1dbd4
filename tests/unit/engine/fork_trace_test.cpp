// SPDX-License-Identifier: Apache-2.0
// Recording what a step forks into changes nothing of it, and names all of its work.
#include "engine/parallel/fork_trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "engine/parallel/fork_join.h"
#include "tests/support/scenes.h"
#include "tests/support/shaken_sheet.h"

namespace warmfront {
namespace {

bool is_balanced(const std::vector<ForkTrace::Event>& events) {
  std::vector<ForkTrace::Kind> open;
  for (const ForkTrace::Event& event : events) {
    if (event.kind == ForkTrace::Kind::kFork || event.kind == ForkTrace::Kind::kTask)
      open.push_back(event.kind);
    if (event.kind != ForkTrace::Kind::kJoin && event.kind != ForkTrace::Kind::kTaskEnd) continue;
    const ForkTrace::Kind begun =
        event.kind == ForkTrace::Kind::kJoin ? ForkTrace::Kind::kFork : ForkTrace::Kind::kTask;
    if (open.empty() || open.back() != begun) return false;
    open.pop_back();
  }
  return open.empty();
}

TEST(ForkTrace, LoopsRunAsTheyDoWithoutIt) {
  for (const bool recorded : {false, true}) {
    ForkTrace trace;
    std::optional<ForkTrace::Recording> recording;
    if (recorded) recording.emplace(trace);
    std::vector<int> touched(5000, 0);
    fork_each(std::size_t{0}, touched.size(), [&](std::size_t i) { ++touched[i]; });
    fork_range(std::size_t{0}, touched.size(), 300, [&](const auto& range) {
      EXPECT_LE(range.size(), 600U);
      for (std::size_t i = range.begin(); i < range.end(); ++i) ++touched[i];
    });
    EXPECT_TRUE(std::ranges::all_of(touched, [](int times) { return times == 2; }));
    int left = 0, right = 0;
    fork_two([&] { ++left; }, [&] { ++right; });
    EXPECT_EQ(left + right, 2);
    for (std::size_t i = 0; i < touched.size(); ++i) touched[i] = static_cast<int>((i * 2654435761U) % 5003);
    std::vector<int> sorted = touched;
    std::ranges::sort(sorted, std::greater<>());
    fork_sort(touched.begin(), touched.end(), std::greater<>());
    EXPECT_EQ(touched, sorted);
    recording.reset();
    EXPECT_EQ(trace.events().empty(), !recorded);
    EXPECT_TRUE(is_balanced(trace.events()));
  }
  EXPECT_EQ(ForkTrace::of_thread(), nullptr);
}

TEST(ForkTrace, AStepThatIsStoppedEndsItsForks) {
  ForkTrace trace;
  {
    const ForkTrace::Recording recording(trace);
    EXPECT_THROW(fork_each(0, 10,
                           [](int i) {
                             if (i == 3) throw std::runtime_error("stopped");
                           }),
                 std::runtime_error);
  }
  EXPECT_TRUE(is_balanced(trace.events()));
}

TEST(ForkTrace, AStepAnswersAsItDoesWithoutIt) {
  const auto scene = testing::make_scene(testing::kSheetVertices, testing::grid(testing::kSheetCells));
  std::vector<double> positions = testing::flat_sheet();
  const auto collider = [&] {
    return Collider::create(scene, std::span<const double>(positions), {}, std::make_shared<Workers>(1))
        .value();
  };
  Collider plain = collider(), recorded = collider();
  std::mt19937_64 random(3);
  ForkTrace trace;
  std::size_t contacts = 0;
  for (int step = 1; step <= 6; ++step) {
    testing::shake(random, 0.03, positions);
    const StepResult expected = plain.step(std::span<const double>(positions)).value();
    contacts += expected.contacts.size();
    trace.clear();
    const ForkTrace::Recording recording(trace);
    const StepResult found = recorded.step(std::span<const double>(positions)).value();
    EXPECT_TRUE(std::ranges::equal(found.contacts, expected.contacts)) << "step " << step;
    EXPECT_EQ(found.statistics.counts.bv_tests, expected.statistics.counts.bv_tests);
    EXPECT_TRUE(std::ranges::any_of(trace.events(), [](const auto& event) {
      return event.kind == ForkTrace::Kind::kFork &&
             std::string(event.file).find("front.cpp") != std::string::npos;
    })) << "the front is brought up to date by tasks";
  }
  EXPECT_GT(contacts, 0U);
}

}  // namespace
}  // namespace warmfront
