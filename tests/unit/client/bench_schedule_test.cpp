// SPDX-License-Identifier: Apache-2.0
// Schedules of recorded computations.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <random>
#include <vector>

#include "client/cli/bench/schedule.h"

namespace warmfront::client {
namespace {

using Kind = ForkTrace::Kind;
using Event = ForkTrace::Event;

Event strand(double seconds) {
  return {Kind::kStrand, seconds};
}
Event fork(std::uint32_t line) {
  return {Kind::kFork, 0, "somewhere/engine/a.cpp", line};
}
constexpr Event kTask{Kind::kTask}, kTaskEnd{Kind::kTaskEnd}, kJoin{Kind::kJoin};

TEST(TaskGraph, SpanAndScheduleOfASmallOne) {
  // 1, then 2 beside (3, then 4 beside 4, then 1), then 1.
  const std::vector<Event> events{strand(1), fork(7),   kTask,     strand(2), kTaskEnd, kTask,     strand(3),
                                  fork(8),   kTask,     strand(4), kTaskEnd,  kTask,    strand(4), kTaskEnd,
                                  kJoin,     strand(1), kTaskEnd,  kJoin,     strand(1)};
  const TaskGraph graph(events);
  EXPECT_DOUBLE_EQ(graph.work(), 16);
  EXPECT_DOUBLE_EQ(graph.span(), 1 + 3 + 4 + 1 + 1);
  EXPECT_DOUBLE_EQ(graph.on_cores(1), 16);
  EXPECT_DOUBLE_EQ(graph.on_cores(2), 10);
  EXPECT_DOUBLE_EQ(graph.on_cores(100), 10);
  const std::vector<TaskGraph::Share> chain = graph.longest_chain();
  ASSERT_EQ(chain.size(), 4U);
  EXPECT_EQ(chain[0].place, "in engine/a.cpp:7");
  EXPECT_DOUBLE_EQ(chain[0].seconds, 4);
  EXPECT_EQ(chain[1].place, "in engine/a.cpp:8");
  double sum = 0;
  for (const TaskGraph::Share& share : chain) sum += share.seconds;
  EXPECT_DOUBLE_EQ(sum, graph.span());
}

TEST(TaskGraph, AForkOfNothingJoins) {
  const TaskGraph graph(std::vector<Event>{strand(1), fork(1), kJoin, strand(2)});
  EXPECT_DOUBLE_EQ(graph.span(), 3);
  EXPECT_DOUBLE_EQ(graph.on_cores(4), 3);
}

// Graham's bound: no core idles while a piece is ready.
TEST(TaskGraph, SchedulesAreWithinTheBounds) {
  std::mt19937_64 random(5);
  const auto below = [&](std::uint64_t n) { return random() % n; };
  for (int round = 0; round < 200; ++round) {
    std::vector<Event> events;
    const auto add = [&](const auto& self, int depth) -> void {
      events.push_back(strand(static_cast<double>(below(100))));
      for (std::uint64_t forks = below(3); depth > 0 && forks > 0; --forks) {
        events.push_back(fork(static_cast<std::uint32_t>(depth)));
        for (std::uint64_t tasks = below(6); tasks > 0; --tasks) {
          events.push_back(kTask);
          self(self, depth - 1);
          events.push_back(kTaskEnd);
        }
        events.push_back(kJoin);
        events.push_back(strand(static_cast<double>(below(100))));
      }
    };
    add(add, 3);
    const TaskGraph graph(events);
    double work = 0;
    for (const Event& event : events) work += event.seconds;
    EXPECT_DOUBLE_EQ(graph.work(), work);
    EXPECT_DOUBLE_EQ(graph.on_cores(1), work);
    for (const std::size_t cores : {2U, 3U, 16U}) {
      const double took = graph.on_cores(cores);
      EXPECT_GE(took, graph.span() * (1 - 1e-12));
      EXPECT_GE(took, work / static_cast<double>(cores) * (1 - 1e-12));
      EXPECT_LE(took, (work / static_cast<double>(cores) + graph.span()) * (1 + 1e-12));
    }
    EXPECT_DOUBLE_EQ(graph.on_cores(events.size()), graph.span());
  }
}

}  // namespace
}  // namespace warmfront::client
