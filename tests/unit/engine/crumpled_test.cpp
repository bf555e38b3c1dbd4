// SPDX-License-Identifier: Apache-2.0
// Sheets that crumple and meet themselves: contacts among neighbouring blocks are found exactly once,
// whatever happens meanwhile.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "engine/collider.h"
#include "tests/support/counted_looks.h"
#include "tests/support/scenes.h"
#include "tests/support/shaken_sheet.h"

namespace warmfront {
namespace {

// Every step's contacts equal those of a collider without caches.
class Crumpled : public ::testing::TestWithParam<Report> {
 protected:
  static ColliderOptions options() {
    return {.report = GetParam(), .bounds = BoundsKind::kKDop18, .find_bodies = false, .leaf_size = 32};
  }
  static Collider make(const testing::Faces& faces, const std::vector<double>& at,
                       const ColliderOptions& options) {
    SceneDescription scene;
    scene.vertex_count = static_cast<std::uint32_t>(at.size() / 3);
    scene.faces = faces;
    return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                            std::span<const double>(at), options, std::make_shared<Workers>(2))
        .value();
  }

  // A collider, and a reference without caches.
  struct Both {
    Both(const testing::Faces& faces, const std::vector<double>& at,
         const ColliderOptions& kept_options = options())
        : lazy(make(faces, at, kept_options)), anew(make(faces, at, without_front(kept_options))) {}

    static ColliderOptions without_front(ColliderOptions options) {
      options.front = FrontMode::kNone;
      options.find_rigid = false;
      return options;
    }

    // Both step; the first repeats the step if it was stopped or refused; `kept` is its answer.
    void expect_same_step(const std::vector<double>& positions, StepResult& kept,
                          const std::atomic<bool>* stop = nullptr, const AcceptStep& accept = {}) {
      const Frame frame{std::span<const double>(positions)};
      Result<StepResult> a = lazy.step(frame, stop, accept);
      if (!a.ok()) a = lazy.step(frame);
      const Result<StepResult> b = anew.step(frame);
      ASSERT_TRUE(a.ok() && b.ok());
      kept = a.value();
      ASSERT_TRUE(std::ranges::equal(kept.contacts, b.value().contacts));
      ASSERT_EQ(kept.vf + kept.ee, b.value().vf + b.value().ee);
      const Status status = lazy.self_check();
      ASSERT_TRUE(status.ok()) << status.error().message;
      if (GetParam() != Report::kEarliest && kept.statistics.counts.parts_rigid == 0) {
        ASSERT_EQ(kept.statistics.counts.triangle_pairs, b.value().statistics.counts.triangle_pairs);
      }
    }

    Collider lazy;
    Collider anew;
  };

  // Now all moves, now some, now nothing, beginning at one of these nine.
  static void expect_same(const testing::Faces& faces, const std::vector<double>& start,
                          std::size_t max_bytes, int begin) {
    std::mt19937_64 random(29);
    std::vector<double> positions = start;
    ColliderOptions kept = options();
    kept.max_front_bytes = max_bytes;
    Both both(faces, positions, kept);
    std::uint64_t met = 0;
    for (int step = 0; step < 45; ++step) {
      const int kind = (step + begin) % 9;
      if (kind < 3) testing::shake(random, kind == 0 ? 0.05 : 0.002, positions);
      if (kind == 3 || kind == 7) {
        std::uniform_real_distribution<double> by(-0.01, 0.01);
        for (std::size_t k = 0; k < positions.size() / 5; ++k) positions[k] += by(random);
      }
      StepResult result;
      ASSERT_NO_FATAL_FAILURE(both.expect_same_step(positions, result)) << "step " << step;
      if (kind == 6 && max_bytes == kRoom && GetParam() != Report::kEarliest) {
        ASSERT_EQ(result.statistics.counts.primitive_tests, 0U) << "at rest, step " << step;
      }
      ASSERT_LE(result.statistics.counts.front_bytes, max_bytes + max_bytes / 2);
      met += result.vf + result.ee;
    }
    EXPECT_GT(met, GetParam() == Report::kEarliest ? 20U : 1000U);
  }

  static constexpr std::size_t kRoom = std::size_t{1} << 30;
};

TEST_P(Crumpled, SheetsMeetThemselvesInEveryStepAsEver) {
  std::mt19937_64 random(31);
  std::vector<double> positions = testing::flat_sheet();
  testing::shake(random, 0.08, positions);
  // The last part is stationary at first, and moves partly when its neighbours are listed.
  for (const auto& [max_bytes, begin] :
       {std::pair(kRoom, 0), std::pair(std::size_t{30000}, 0), std::pair(std::size_t{8000}, 0),
        std::pair(std::size_t{1000}, 0), std::pair(kRoom, 5)})
    expect_same(testing::grid(testing::kSheetCells), positions, max_bytes, begin);
}

// Deforming, stiff for so long that it need not be tested against itself, crumpled, cancelled.
TEST_P(Crumpled, WhateverHappensMeanwhile) {
  std::mt19937_64 random(47);
  std::vector<double> positions = testing::flat_sheet();
  Both both(testing::grid(testing::kSheetCells), positions);
  std::uint64_t stiff = 0;
  int stopped = 0;
  std::uint64_t met = 0;
  for (int step = 0; step < 50; ++step) {
    if (step < 4 || step > 36) testing::shake(random, 0.002, positions);
    if (step == 36) testing::shake(random, 0.08, positions);
    if (step >= 4 && step < 36) {
      for (double& x : positions) x += 1.0 / 64;
    }
    AcceptStep accept;
    if (step == 2 || step == 40)
      accept = [](const StepResult&) -> Status {
        return Error{ErrorCode::kCancelled, "as its client wishes"};
      };
    StepResult result;
    ASSERT_NO_FATAL_FAILURE(both.expect_same_step(positions, result, nullptr, accept)) << "step " << step;
    stopped += result.statistics.rebuild == Rebuild::kInterrupted ? 1 : 0;
    stiff += result.statistics.counts.parts_rigid;
    met += result.vf + result.ee;
  }
  EXPECT_GT(stiff, 0U);
  EXPECT_EQ(stopped, 2);
  EXPECT_GT(met, 10U);
}

// A line search from each place: trials of ever shorter motions, and one elsewhere, of which the last, a part
// of it or none is taken. Each answers as a collider that keeps nothing.
TEST_P(Crumpled, TrialsAnswerAsStepsAndLeaveNoTrace) {
  std::mt19937_64 random(83);
  std::vector<double> positions = testing::flat_sheet();
  Both both(testing::grid(testing::kSheetCells), positions);
  std::uint64_t met = 0, skipped = 0;
  for (int step = 0; step < 40; ++step) {
    for (int trial = 0; trial < 4; ++trial) {
      std::vector<double> to = positions;
      testing::shake(random, step % 7 == 0 ? 0.06 : 0.004 / (trial + 1), to);
      const Frame frame{std::span<const double>(to)};
      const Result<StepResult> a = both.lazy.trial(frame);
      const Result<StepResult> b = both.anew.trial(frame);
      ASSERT_TRUE(a.ok() && b.ok());
      ASSERT_TRUE(std::ranges::equal(a.value().contacts, b.value().contacts)) << step << "." << trial;
      ASSERT_EQ(a.value().vf + a.value().ee, b.value().vf + b.value().ee);
      ASSERT_EQ(both.lazy.positions(), positions);
      const Status status = both.lazy.self_check();
      ASSERT_TRUE(status.ok()) << status.error().message;
      met += a.value().vf + a.value().ee;
      if (trial > 0) skipped += a.value().statistics.counts.front_skipped;
    }
    const double fraction = std::array{1.0, 0.5, 0.0, 0.3}[static_cast<std::size_t>(step % 4)];
    ASSERT_TRUE(both.lazy.commit(fraction).ok());
    ASSERT_TRUE(both.anew.commit(fraction).ok());
    positions = both.lazy.positions();
    ASSERT_EQ(both.anew.positions(), positions);
    if (step % 5 != 0) continue;
    testing::shake(random, 0.002, positions);
    StepResult result;
    ASSERT_NO_FATAL_FAILURE(both.expect_same_step(positions, result)) << "step " << step;
  }
  EXPECT_GT(met, 10U);
  EXPECT_GT(skipped, 100U) << "trials share what was measured at their base";
}

// Stopped before, while or after the refit tests among neighbours, or not at all: the repeated frame is
// answered as always.
TEST_P(Crumpled, StoppedAtAnyMoment) {
  std::mt19937_64 random(61);
  std::vector<double> positions = testing::flat_sheet();
  Both both(testing::grid(testing::kSheetCells), positions);
  int stopped = 0;
  long looks = 1;  // of a step at the flag
  for (int step = 0; step < 120; ++step) {
    testing::shake(random, step % 9 == 0 ? 0.05 : 0.002, positions);
    const bool stops = step % 3 == 0;  // two steps for a front with neighbours, and one to stop
    const testing::CountedLooks counted(
        stops ? static_cast<long>(random() % static_cast<std::uint64_t>(looks)) : -1);
    StepResult result;
    both.expect_same_step(positions, result, testing::CountedLooks::flag());
    ASSERT_FALSE(HasFatalFailure()) << "step " << step;
    if (!stops) looks = testing::CountedLooks::count();
    stopped += result.statistics.rebuild == Rebuild::kInterrupted ? 1 : 0;
  }
  EXPECT_GT(looks, 100);
  EXPECT_GT(stopped, 20) << "of 40";
}

// A step with too many contacts is rolled back, including the refit's tests.
TEST_P(Crumpled, RefusedForTooManyContacts) {
  std::mt19937_64 random(67);
  std::vector<double> positions = testing::flat_sheet();
  ColliderOptions few = options();
  few.max_contacts = 1000;
  Both both(testing::grid(testing::kSheetCells), positions, few);
  int refused = 0;
  for (int step = 0; step < 24; ++step) {
    std::vector<double> next = positions;
    testing::shake(random, step % 6 == 5 ? 0.4 : 0.01, next);
    if (step % 6 == 5 && GetParam() == Report::kAll) {
      const Frame frame{std::span<const double>(next)};
      ASSERT_FALSE(both.lazy.step(frame).ok()) << "step " << step;
      ASSERT_FALSE(both.anew.step(frame).ok()) << "step " << step;
      ASSERT_TRUE(both.lazy.self_check().ok()) << both.lazy.self_check().error().message;
      ++refused;
    } else {
      StepResult result;
      ASSERT_NO_FATAL_FAILURE(both.expect_same_step(next, result)) << "step " << step;
      positions = next;
    }
  }
  EXPECT_EQ(refused, GetParam() == Report::kAll ? 4 : 0);
}

// A sheet that becomes a cloud: its hierarchy has decayed and is rebuilt, and so are its neighbours.
TEST_P(Crumpled, ADecayedHierarchyIsRebuiltWithItsNeighbours) {
  std::mt19937_64 random(59);
  std::vector<double> positions = testing::flat_sheet();
  Both both(testing::grid(testing::kSheetCells), positions);
  int decayed = 0;
  for (int step = 0; step < 16; ++step) {
    testing::shake(random, step == 4 ? 3.0 : 0.001, positions);
    StepResult result;
    ASSERT_NO_FATAL_FAILURE(both.expect_same_step(positions, result)) << "step " << step;
    decayed += result.statistics.rebuild == Rebuild::kDecayed ? 1 : 0;
  }
  EXPECT_EQ(decayed, 1);
}

// A front that fits without its neighbours is not repeatedly dropped and rebuilt because of them.
TEST_P(Crumpled, IsNotDroppedAgainAndAgain) {
  std::mt19937_64 random(43);
  std::vector<double> start = testing::flat_sheet();
  testing::shake(random, 0.02, start);
  int updated = 0;
  for (std::size_t max_bytes = 1000; max_bytes < 60000; max_bytes += 1000) {
    ColliderOptions kept = options();
    kept.max_front_bytes = max_bytes;
    std::vector<double> positions = start;
    Collider collider = make(testing::grid(testing::kSheetCells), positions, kept);
    std::vector<FrontState> states;
    for (int step = 0; step < 6; ++step) {
      testing::shake(random, 1e-4, positions);
      const Frame frame{std::span<const double>(positions)};
      states.push_back(collider.step(frame).value().statistics.front_state);
    }
    EXPECT_EQ(std::ranges::count(states, FrontState::kRebuilt), 0) << max_bytes;
    const auto capped = std::ranges::count(states, FrontState::kCapped);
    EXPECT_TRUE(capped == 0 || capped == 6) << max_bytes << " bytes: capped " << capped << " times";
    updated += capped == 0 ? 1 : 0;
  }
  EXPECT_GT(updated, 0);
  EXPECT_LT(updated, 59);
}

// Where the contacts of what is stationary do not fit, the front is dropped after many steps, to try again.
// Its neighbours are dropped with it, so none of them may have been tested in that step.
TEST_P(Crumpled, IsBuiltAgainWhereAnswersDidNotFit) {
  if (GetParam() != Report::kAll) GTEST_SKIP() << "keeps no contacts";
  constexpr int kSteps = 262;
  constexpr int kChecked = 12;  // the last ones
  std::mt19937_64 random(71);
  std::vector<double> positions = testing::flat_sheet();
  testing::shake(random, 0.02, positions);
  ColliderOptions kept = options();
  kept.max_front_bytes = 60000;
  kept.min_separation = 0.2;
  kept.find_rigid = false;
  Both both(testing::grid(testing::kSheetCells), positions, kept);
  const auto move_some = [&] {
    std::uniform_real_distribution<double> by(-1e-4, 1e-4);
    for (std::size_t k = 0; k < positions.size() / 8; ++k) positions[k] += by(random);
  };
  for (int step = 0; step < kSteps - kChecked; ++step) {
    move_some();
    ASSERT_TRUE(both.lazy.step(Frame{std::span<const double>(positions)}).ok());
  }
  ASSERT_TRUE(both.anew.step(Frame{std::span<const double>(positions)}).ok());
  std::uint64_t bytes = 0;
  int dropped = 0;
  for (int step = 0; step < kChecked; ++step) {
    move_some();
    StepResult result;
    ASSERT_NO_FATAL_FAILURE(both.expect_same_step(positions, result)) << "step " << step;
    const std::uint64_t before = std::exchange(bytes, result.statistics.counts.front_bytes);
    dropped += bytes < before / 2 ? 1 : 0;
  }
  EXPECT_EQ(dropped, 1);
}

// Of a vertex of more than SharedVertices::kMostAround it is not known which blocks share it.
TEST_P(Crumpled, FansDoToo) {
  std::mt19937_64 random(37);
  testing::Faces faces;
  std::int32_t vertices = 0;
  for (const int around : {60, 150, 40, 90}) {
    for (std::int32_t i = 0; i < around; ++i)
      faces.push_back({vertices, vertices + 1 + i, vertices + 1 + (i + 1) % around});
    vertices += around + 1;
  }
  std::vector<double> positions(3 * static_cast<std::size_t>(vertices));
  testing::shake(random, 0.5, positions);
  for (const int begin : {0, 5}) expect_same(faces, positions, kRoom, begin);
}

// Where most blocks share vertices, not all that do find a place in each other's row.
TEST_P(Crumpled, TanglesDoToo) {
  std::mt19937_64 random(41);
  constexpr std::int32_t kPoints = 36;
  testing::Faces faces;
  while (faces.size() < 400) {
    std::array<std::int32_t, 3> face;
    for (std::int32_t& v : face) v = static_cast<std::int32_t>(random() % kPoints);
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) faces.push_back(face);
  }
  std::vector<double> positions(std::size_t{3} * kPoints);
  testing::shake(random, 0.5, positions);
  for (const int begin : {0, 5}) expect_same(faces, positions, kRoom, begin);
}

INSTANTIATE_TEST_SUITE_P(Reports, Crumpled,
                         ::testing::Values(Report::kAll, Report::kEarliest, Report::kCount));

}  // namespace
}  // namespace warmfront
