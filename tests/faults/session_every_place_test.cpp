// SPDX-License-Identifier: Apache-2.0
// Memory runs out in a daemon's session at every allocation in turn, in whichever thread: each request is
// answered once, or throws and has no effect. The same request, sent again, and the next one then give the
// same results as without the failure. And no exception leaves the log sink for what gRPC reports.
#include "tests/faults/session_every_place.h"

#include <grpc/support/log.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <random>
#include <sstream>
#include <thread>

#include "server/observe/grpc_log.h"
#include "server/session/session.h"
#include "tests/faults/now_trying.h"
#include "tests/support/counted_looks.h"
#include "tests/support/failing_allocations.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {
namespace {

using server::Session;
using testing::FailingAllocations;
using testing::now_trying;

INSTANTIATE_TEST_SUITE_P(Guests, SessionEveryPlace, ::testing::Values(0, 1));

TEST_P(SessionEveryPlace, AFrame) {
  for (std::uint64_t frame = 1; frame + 2 <= kFrames; ++frame) {
    long n = 0;
    for (bool met = true; met; ++n) {
      now_trying = "frame " + std::to_string(frame) + ", allocation " + std::to_string(n);
      SCOPED_TRACE(now_trying);
      ASSERT_NO_FATAL_FAILURE(begin());
      for (std::uint64_t before = 1; before < frame; ++before) ASSERT_NO_FATAL_FAILURE(expect_answer(before));
      const auto reply = send(frame, n);
      met = FailingAllocations::met();
      if (reply != nullptr) {
        ASSERT_EQ(reply->times(), 1);
        ASSERT_TRUE(met || reply->ok());
        if (!reply->ok()) {
          EXPECT_EQ(reply->code(), ErrorCode::kResourceExhausted);
        }
      }
      ASSERT_FALSE(lost_) << "the session was dropped";
      ASSERT_NO_FATAL_FAILURE(expect_answer(frame));
      ASSERT_NO_FATAL_FAILURE(expect_answer(frame + 1));
      ASSERT_NO_FATAL_FAILURE(expect_answer(frame + 2));
    }
    std::printf("frame %d: %ld allocations failed\n", static_cast<int>(frame), n - 1);
  }
}

// With the same key it may be sent again: it is carried out once.
TEST_P(SessionEveryPlace, AChange) {
  const auto expected = change(-1);
  ASSERT_TRUE(expected != nullptr && expected->ok());
  long n = 0;
  for (bool met = true; met; ++n) {
    now_trying = "a change, allocation " + std::to_string(n);
    SCOPED_TRACE(now_trying);
    ASSERT_NO_FATAL_FAILURE(begin());
    const auto reply = change(n);
    met = FailingAllocations::met();
    if (reply != nullptr) {
      ASSERT_EQ(reply->times(), 1);
      ASSERT_TRUE(met || reply->ok());
      EXPECT_EQ(session_->scene()->body_count(), reply->ok() ? 3U : 2U);
    }
    ASSERT_FALSE(lost_) << "the session was dropped";
    const auto again = change(-1);
    ASSERT_NE(again, nullptr);
    ASSERT_EQ(again->times(), 1);
    ASSERT_TRUE(again->ok()) << "code " << static_cast<int>(*again->code());
    EXPECT_EQ(again->value(), expected->value());
    EXPECT_EQ(session_->snapshot().state, expected->value()) << "its digest is of all that it is";
    EXPECT_EQ(session_->scene()->body_count(), 3U);
  }
  std::printf("%ld allocations failed\n", n - 1);
}

// Filters too, and the body that they are of.
TEST_P(SessionEveryPlace, ABodyAndFilters) {
  const PairFilters filters = all_filters(grids_.vertex_count() + 3);
  const auto change = [&](long n) {
    return carry_out({1, {a_triangle(), server::ChangeFilters{filters}}, "key"}, n);
  };
  const auto expected = change(-1);
  ASSERT_TRUE(expected != nullptr && expected->ok());
  long n = 0;
  for (bool met = true; met; ++n) {
    now_trying = "a body and filters, allocation " + std::to_string(n);
    SCOPED_TRACE(now_trying);
    ASSERT_NO_FATAL_FAILURE(begin());
    const server::SessionState before = session_->snapshot().state;
    const auto reply = change(n);
    met = FailingAllocations::met();
    const bool made = reply != nullptr && reply->ok();
    ASSERT_TRUE(met || made);
    EXPECT_EQ(session_->scene()->filters(), made ? filters : PairFilters());
    EXPECT_EQ(session_->snapshot().state, made ? expected->value() : before);
    ASSERT_FALSE(lost_) << "the session was dropped";
    if (!made && n % 2 == 0) {  // the other half goes on with the change
      ASSERT_NO_FATAL_FAILURE(expect_answer(1));
      continue;
    }
    const auto again = change(-1);
    ASSERT_TRUE(again != nullptr && again->ok());
    EXPECT_EQ(again->value(), expected->value());
    EXPECT_EQ(session_->scene()->filters(), filters);
  }
  std::printf("%ld allocations failed\n", n - 1);
}

// All or none of them: after a cancellation or out of memory at any place, the session is unchanged.
TEST_P(SessionEveryPlace, FiveChangesAreOne) {
  const auto expected = change_five(1, -1);
  ASSERT_TRUE(expected != nullptr && expected->ok());
  for (const bool gives_up : {true, false}) {
    long n = 0;
    for (bool met = true; met; ++n) {
      now_trying = (gives_up ? "five changes, look " : "five changes, allocation ") + std::to_string(n);
      SCOPED_TRACE(now_trying);
      ASSERT_NO_FATAL_FAILURE(begin());
      const server::SessionState before = session_->snapshot().state;
      const auto reply = gives_up ? change_five(1, n) : change_five(1, -1, n);
      met = gives_up ? testing::CountedLooks::met() : FailingAllocations::met();
      ASSERT_FALSE(lost_) << "the session was dropped";
      if (reply == nullptr || !reply->ok()) {
        ASSERT_TRUE(met);
        ASSERT_TRUE(reply == nullptr || reply->times() == 1);
        if (reply != nullptr) {
          EXPECT_EQ(reply->code(), gives_up ? ErrorCode::kCancelled : ErrorCode::kResourceExhausted);
        }
        EXPECT_EQ(session_->snapshot().state, before);
        EXPECT_EQ(session_->scene()->body_count(), 2U);
        if (n % 2 == 0) {  // the other half goes on with the changes
          ASSERT_NO_FATAL_FAILURE(expect_answer(1));
          continue;
        }
      }
      const auto again = change_five(1, -1);
      ASSERT_TRUE(again != nullptr && again->ok());
      EXPECT_EQ(again->value(), expected->value());
      EXPECT_EQ(session_->scene()->body_count(), 4U);
    }
    std::printf("%ld %s\n", n - 1, gives_up ? "looks ended it" : "allocations failed");
    EXPECT_GT(n, gives_up ? 5 + 1 : 1) << "at least between the changes";
  }
}

// What a session holds, scene, hierarchy, answer and all, is charged to its account: at least what the
// allocator says, in every state.
TEST_P(SessionEveryPlace, WhatIsHeldIsCharged) {
  constexpr std::size_t kOfTest = 1024;  // its own strings
  std::mt19937_64 random(11);
  const auto below = [&](std::uint64_t n) { return random() % n; };
  for (int history = 0; history < 500; ++history) {
    const std::weak_ptr<Session> last = session_;
    TearDown();
    session_.reset();
    while (!last.expired()) std::this_thread::yield();  // its last request is let go of
    wait_for_runner();                                  // and it is gone
    const auto before = static_cast<std::ptrdiff_t>(testing::live_bytes());
    ASSERT_NO_FATAL_FAILURE(begin());
    std::uint64_t frame = 0;
    std::size_t bodies = 2;
    for (int step = 0; step < 12; ++step) {
      switch (below(3)) {
        case 0: {
          server::ChangeOrder order{frame + 1, {}, std::string(below(100), 'k')};
          for (std::uint64_t i = below(3); i < 3; ++i) {
            server::AddBody add = a_triangle();
            add.addition.body.name = std::string(below(500), 'n');
            order.changes.emplace_back(std::move(add));
          }
          if (below(3) == 0) {
            const std::size_t added = order.changes.size();
            order.changes.emplace_back(
                server::ChangeFilters{below(3) == 0 ? PairFilters()
                                                    : all_filters(session_->scene()->vertex_count() +
                                                                  3 * static_cast<std::uint32_t>(added))});
          }
          if (below(3) == 0) order.changes.emplace_back(server::ChangeExcludedPairs{{{0, 1}}});
          if (below(3) == 0) {
            order.options = session_->options();
            order.options->min_separation = static_cast<double>(below(3));
            order.options->front = static_cast<FrontMode>(below(3));
          }
          if (below(2) == 0) {
            Body removed;
            removed.kind = BodyKind::kRemoved;
            removed.vertex_count = 1;
            order.changes.emplace_back(
                server::ChangeBody{static_cast<std::uint32_t>(below(bodies)), removed});
          }
          const auto reply = carry_out(std::move(order), -1);
          ASSERT_NE(reply, nullptr);
          bodies = session_->scene()->body_count();
          break;
        }
        default: {
          std::string all = bytes_of(frame + 1);
          const std::vector<double>& added = a_triangle().positions;
          while (all.size() < std::size_t{24} * session_->scene()->vertex_count())
            all.append(reinterpret_cast<const char*>(added.data()), added.size() * sizeof(double));
          static_cast<void>(send(frame + 1, below(2) == 0 ? -1 : static_cast<long>(below(40)), all));
          frame = session_->snapshot().state.frame;
          break;
        }
      }
      ASSERT_FALSE(HasFailure());
      // A request, and what its step took, are released after its answer.
      const auto held = [&] { return static_cast<std::ptrdiff_t>(testing::live_bytes()) - before; };
      const auto charged = static_cast<std::ptrdiff_t>(session_->account()->held() + kOfTest);
      for (int i = 0; i < 1000 && held() > charged; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ASSERT_LE(held(), charged) << "history " << history << ", step " << step;
    }
  }
}

TEST(GrpcLogEveryPlace, GrpcIsNotLeftByAnException) {
  static std::ostringstream& lines = *new std::ostringstream;  // gRPC may speak until the end
  server::log_what_grpc_says(*new server::Log(server::LogLevel::kInfo, server::LogFormat::kJson, &lines));
  gpr_set_log_verbosity(GPR_LOG_SEVERITY_INFO);
  for (const auto which : {FailingAllocations::Which::kOne, FailingAllocations::Which::kAllFromThere}) {
    bool met = true;
    long n = 0;
    for (; met; ++n) {
      const std::string words = "failed " + std::to_string(static_cast<int>(which)) + " " + std::to_string(n);
      now_trying = words;
      lines.clear();  // of having failed
      const FailingAllocations failing(n, which);
      EXPECT_NO_THROW(gpr_log(GPR_INFO, "%s", words.c_str()));
      met = FailingAllocations::met();
    }
    EXPECT_GT(n, 3) << "a test in which nothing fails shows nothing";
    EXPECT_NE(
        lines.str().find("failed " + std::to_string(static_cast<int>(which)) + " " + std::to_string(n - 1)),
        std::string::npos)
        << "with memory there is a full message";
  }
}

}  // namespace
}  // namespace warmfront::test
