// SPDX-License-Identifier: Apache-2.0
// The parts of a session that need no network: ids, positions from bytes, frame numbers, the store. The
// mailbox and the runner: mailbox_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <future>
#include <latch>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/session/frame_sequence.h"
#include "server/session/id.h"
#include "server/session/mailbox.h"
#include "server/session/position_buffer.h"
#include "server/session/spare_positions.h"
#include "server/session/step_cost.h"
#include "server/session/store.h"
#include "tests/support/observers.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::server {
namespace {

using ::testing::HasSubstr;

constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";

TEST(SessionIdTest, TakesUuidsOnlyAndLowersThem) {
  EXPECT_EQ(SessionId::parse("01234567-89AB-cdef-0123-456789ABCDEF").value().text(), kId);
  for (const char* bad : {"", "1", "01234567-89ab-cdef-0123-456789abcdeg",
                          "0123456-789ab-cdef-0123-456789abcdef", "01234567-89ab-cdef-0123-456789abcdef0"})
    EXPECT_EQ(SessionId::parse(bad).fault().code, ErrorCode::kInvalidArgument) << bad;
}

TEST(PositionBufferTest, PiecesMayEndAnywhere) {
  const std::vector<float> values{1.5f, -2.0f, 3.25f, 0.0f, -0.0f, 1e30f};
  const std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  for (std::size_t piece = 1; piece <= bytes.size(); ++piece) {
    PositionBuffer buffer(Dtype::kFloat32, 2);
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      EXPECT_FALSE(buffer.complete().ok());
      ASSERT_TRUE(buffer.append(bytes.substr(at, piece)).ok());
    }
    ASSERT_TRUE(buffer.complete().ok());
    const auto view = std::get<std::span<const float>>(buffer.view());
    EXPECT_EQ(std::memcmp(view.data(), values.data(), bytes.size()), 0);
  }
}

TEST(PositionBufferTest, AnOverflowIsReportedWithTheLengths) {
  PositionBuffer buffer(Dtype::kFloat64, 1);
  ASSERT_TRUE(buffer.append(std::string(24, '\0')).ok());
  const Status over = buffer.append("x");
  ASSERT_FALSE(over.ok());
  EXPECT_THAT(over.error().message, HasSubstr("25 bytes"));
  EXPECT_THAT(over.error().message, HasSubstr("24 bytes are expected (1 vertices x 3 x float64)"));
  EXPECT_FALSE(buffer.complete().ok());
}

TEST(PositionBufferTest, EqualityIsBitwise) {
  PositionBuffer zeros(Dtype::kFloat32, 1), same(Dtype::kFloat32, 1), other(Dtype::kFloat32, 1);
  const float plus[3] = {0, 0, 0}, minus[3] = {0, -0.0f, 0};
  ASSERT_TRUE(zeros.append({reinterpret_cast<const char*>(plus), 12}).ok());
  ASSERT_TRUE(same.append({reinterpret_cast<const char*>(plus), 12}).ok());
  ASSERT_TRUE(other.append({reinterpret_cast<const char*>(minus), 12}).ok());
  EXPECT_TRUE(same == zeros);
  EXPECT_FALSE(other == zeros);
}

TEST(PositionBufferTest, TakesTheMemoryOfOneThatIsDoneWhereItFits) {
  constexpr std::uint32_t kVertices = 8;
  const std::string bytes(24 * kVertices, 'a');
  // How much memory positions are in then.
  const auto after_one_of = [&](std::uint32_t vertices, Dtype dtype) {
    PositionBuffer done(dtype, vertices);
    EXPECT_TRUE(done.append(std::string(3 * vertices * size_of(dtype), 'x')).ok());
    PositionBuffer next(Dtype::kFloat64, kVertices);
    next.reuse(done.release());
    EXPECT_FALSE(next.complete().ok()) << "it is empty";
    EXPECT_TRUE(next.append(bytes).ok());
    EXPECT_EQ(next.bytes(), bytes);
    PositionBuffer fresh(Dtype::kFloat64, kVertices);
    EXPECT_TRUE(fresh.append(bytes).ok());
    EXPECT_TRUE(next == fresh);
    return next.release().bytes();
  };
  EXPECT_EQ(after_one_of(9, Dtype::kFloat64), 216U);
  EXPECT_EQ(after_one_of(7, Dtype::kFloat64), 192U) << "too small";
  EXPECT_EQ(after_one_of(16, Dtype::kFloat64), 192U) << "too large";
  EXPECT_EQ(after_one_of(18, Dtype::kFloat32), 192U) << "of other numbers";
}

TEST(SparePositionsTest, AreChargedWhileTheyAreKept) {
  server::Budget budget(std::size_t{1} << 30);
  const auto account = server::Account::open(budget, std::size_t{1} << 30, 0).value();
  server::SparePositions spare(account);
  const auto memory_of = [](std::uint32_t vertices) {
    PositionBuffer done(Dtype::kFloat64, vertices);
    EXPECT_TRUE(done.append(std::string(std::size_t{24} * vertices, 'x')).ok());
    return done.release();
  };
  spare.keep(memory_of(10));
  EXPECT_EQ(account->held(), 0U) << "too small to keep";
  spare.keep(memory_of(20000));
  EXPECT_EQ(account->held(), 480000U);
  spare.keep(memory_of(30000));
  spare.keep(memory_of(20000));
  EXPECT_EQ(account->held(), 720000U) << "the largest";
  EXPECT_EQ(spare.take().bytes(), 720000U);
  EXPECT_EQ(account->held(), 0U);
  EXPECT_EQ(spare.take().bytes(), 0U);
}

TEST(FrameSequenceTest, NextRepeatAndOutOfOrder) {
  using Verdict = FrameSequence::Verdict;
  FrameSequence frames(7);
  EXPECT_EQ(frames.classify(7), Verdict::kOutOfOrder) << "the first frame has no answer to repeat";
  EXPECT_EQ(frames.classify(8), Verdict::kNext);
  EXPECT_EQ(frames.classify(9), Verdict::kOutOfOrder);
  frames.advance();
  EXPECT_EQ(frames.classify(8), Verdict::kRepeat);
  EXPECT_EQ(frames.classify(7), Verdict::kOutOfOrder);
  EXPECT_EQ(frames.expected(), 9u);
  EXPECT_EQ(frames.steps(), 1u);
}

TEST(StepCostTest, IsByWhatWasDone) {
  EXPECT_EQ(lane_of(step_cost_ms(4344, {})), Lane::kShort);
  StepCounts busy;
  busy.elementary_tests = 1'000'000;
  EXPECT_EQ(lane_of(step_cost_ms(4344, busy)), Lane::kLong);
  EXPECT_EQ(lane_of(step_cost_ms(1'000'000, {})), Lane::kLong);
  EXPECT_TRUE(is_brief(step_cost_ms(4344, {})));
  EXPECT_FALSE(is_brief(step_cost_ms(92'000, {})));
  EXPECT_FALSE(is_brief(Mailbox::kUnforeseen));
}

class StoreTest : public ::testing::Test {
 protected:
  std::shared_ptr<Session> make(const SessionId& id) {
    const test::MovingGrids grids(3);
    PositionBuffer positions(Dtype::kFloat64, grids.vertex_count());
    const std::vector<double> start = grids.positions(0);
    EXPECT_TRUE(positions.append({reinterpret_cast<const char*>(start.data()), start.size() * 8}).ok());
    return Session::create({id, grids.scene(), {}, Dtype::kFloat64, 0, {}}, positions,
                           {workers_, runner_, limits_, Account::open(budget_, 1 << 30, 0).value(),
                            [](Session&, const Fault&) {}})
        .value();
  }
  std::shared_ptr<Workers> workers_ = std::make_shared<Workers>(1);
  Budget budget_{1 << 30};
  Runner runner_{1};
  const Limits limits_{};
  const SessionId id_ = SessionId::parse(kId).value();
};

TEST_F(StoreTest, APlaceIsTakenGivenBackAndFilled) {
  Store store(1);
  {
    const auto place = store.reserve(id_);
    ASSERT_TRUE(place.ok());
    EXPECT_EQ(store.reserve(id_).fault().code, ErrorCode::kAlreadyExists);
    EXPECT_EQ(store.reserve(SessionId::parse("11234567-89ab-cdef-0123-456789abcdef").value()).fault().code,
              ErrorCode::kResourceExhausted);
    EXPECT_EQ(store.find(id_).fault().code, ErrorCode::kNotFound) << "still being built";
  }
  EXPECT_EQ(store.size(), 0u);
  store.reserve(id_).value().fill(make(id_));
  EXPECT_TRUE(store.find(id_).ok());
  EXPECT_EQ(store.list().size(), 1u);
}

TEST_F(StoreTest, OnlyIdleSessionsWithoutAStreamExpire) {
  Store store(1);
  const std::shared_ptr<Session> session = make(id_);
  store.reserve(id_).value().fill(session);
  EXPECT_TRUE(store.remove_idle(std::chrono::hours(1)).empty());
  const auto attachment = session->attach(
      {}, [](const Fault&) {}, [](const Outcome<Standing>&) {});
  ASSERT_TRUE(attachment.ok());
  EXPECT_TRUE(store.remove_idle(std::chrono::milliseconds(0)).empty());
  session->detach(attachment.value());
  EXPECT_EQ(store.remove_idle(std::chrono::milliseconds(0)).size(), 1u);
  EXPECT_EQ(store.size(), 0u);
}

// A stream's eviction and its next frame may cross: that frame is not carried out, since the stream that took
// over was told the session's state before it.
TEST_F(StoreTest, AFrameOfAStreamThatWasTakenOverIsRefused) {
  const std::shared_ptr<Session> session = make(id_);
  const auto attach = [&] {
    std::promise<std::uint64_t> frame;
    const auto attachment = session->attach(
        {.takeover = true}, [](const Fault&) {},
        [&](const Outcome<Standing>& standing) { frame.set_value(standing.value().now.frame); });
    EXPECT_EQ(frame.get_future().get(), 0u);
    return attachment.value();
  };
  const std::vector<double> moved = test::MovingGrids(3).positions(1);
  const auto step = [&](std::optional<Attachment> from) {
    FrameBuffer positions(Dtype::kFloat64, *session->scene());
    EXPECT_TRUE(positions.append({reinterpret_cast<const char*>(moved.data()), moved.size() * 8}).ok());
    FramePass pass;
    pass.attachment = from;
    std::promise<Outcome<std::shared_ptr<const Answer>>> done;
    session->submit({1, FrameQuestion{std::move(positions)}, std::move(pass),
                     test::tell_frame([&](const FrameOutcome& outcome) { done.set_value(outcome); })},
                    Session::Admission::kAlways);
    return done.get_future().get();
  };
  const Attachment before = attach(), now = attach();
  const auto refused = step(before);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.fault().code, ErrorCode::kAborted);
  EXPECT_EQ(refused.fault().reason, Reason::kSessionAttached);
  EXPECT_TRUE(step(now).ok());
  EXPECT_TRUE(step(std::nullopt).ok()) << "a call without a stream, of the same frame";
}

// A step that takes longer than the idle timeout is answered from a session that is there.
TEST_F(StoreTest, ASessionWithARequestInHandDoesNotExpire) {
  Store store(1);
  const std::shared_ptr<Session> session = make(id_);
  store.reserve(id_).value().fill(session);
  // The runner outlives the latches: no thread may still be leaving `go` when the test ends.
  std::latch begun(1), go(1), gone(2);
  std::promise<void> checked;
  runner_.post([&] {
    begun.count_down();
    go.wait();
    gone.count_down();
  });
  runner_.post(
      [&] {
        go.wait();
        gone.count_down();
      },
      Lane::kShort);
  begun.wait();
  session->check([&](const Outcome<std::string>& found) {
    EXPECT_TRUE(found.ok());
    checked.set_value();
  });
  const bool stayed = store.remove_idle(std::chrono::milliseconds(0)).empty();
  go.count_down();
  gone.wait();
  ASSERT_TRUE(stayed) << "its runner is busy with others";
  checked.get_future().wait();
  // The request is done a moment after it was answered.
  while (store.remove_idle(std::chrono::milliseconds(0)).empty()) std::this_thread::yield();
  EXPECT_EQ(store.size(), 0u);
}

TEST_F(StoreTest, ACancelledFrameIsNotRun) {
  const std::shared_ptr<Session> session = make(id_);
  const test::MovingGrids grids(3);
  const auto step = [&](bool given_up) {
    FrameBuffer positions(Dtype::kFloat64, *session->scene());
    const std::vector<double> values = grids.positions(1);
    EXPECT_TRUE(positions.append({reinterpret_cast<const char*>(values.data()), values.size() * 8}).ok());
    FramePass pass;
    pass.given_up = std::make_shared<std::atomic<bool>>(given_up);
    std::promise<Outcome<std::shared_ptr<const Answer>>> answer;
    session->submit({1, FrameQuestion{std::move(positions)}, std::move(pass),
                     test::tell_frame([&](const FrameOutcome& outcome) { answer.set_value(outcome); })},
                    Session::Admission::kBounded);
    return answer.get_future().get();
  };
  const auto given_up = step(true);
  ASSERT_FALSE(given_up.ok());
  EXPECT_EQ(given_up.fault().code, ErrorCode::kCancelled);
  EXPECT_EQ(session->snapshot().steps, 0u);
  EXPECT_TRUE(step(false).ok());
  EXPECT_EQ(session->snapshot().steps, 1u);
}

}  // namespace
}  // namespace warmfront::server
