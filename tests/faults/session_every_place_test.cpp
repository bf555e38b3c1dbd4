// SPDX-License-Identifier: Apache-2.0
// Memory runs out in a daemon's session at every allocation in turn, in whichever thread: each request is
// answered once, or throws and has no effect. The same request, sent again, and the next one then give the
// same results as without the failure. And no exception leaves the log sink for what gRPC reports.
#include <grpc/support/log.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <cstdio>
#include <exception>
#include <future>
#include <mutex>
#include <optional>
#include <random>
#include <sstream>
#include <thread>

#include "server/observe/grpc_log.h"
#include "server/session/session.h"
#include "tests/support/counted_looks.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/observers.h"
#include "tests/support/scenes.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {
namespace {

using server::Answer;
using server::Fault;
using server::FrameBuffer;
using server::Outcome;
using server::Session;
using testing::FailingAllocations;

constexpr std::uint32_t kSide = 4;

std::string now_trying;  // NOLINT: read by the handler below
[[noreturn]] void tell_and_end() {
  std::fprintf(stderr, "the process ended in: %s\n", now_trying.c_str());
  std::abort();
}
const auto installed = std::set_terminate(tell_and_end);

std::uint64_t hash_of(const Answer& answer) {
  ContactHash hash;
  hash.begin_step(answer.rows());
  for (std::size_t i = 0; i < answer.rows(); ++i)
    hash.add(static_cast<ContactKind>(answer.kind[i]), static_cast<ContactStatus>(answer.status[i]),
             answer.vertices[i], answer.toi[i]);
  return hash.value();
}

/// What an observer was told, and how often; recording it needs no memory.
template <class T>
class Reply {
 public:
  void take(const Outcome<T>& outcome) {
    const std::lock_guard lock(mutex_);
    if (outcome.ok()) {
      value_ = outcome.value();
    } else {
      code_ = outcome.fault().code;
    }
    ++times_;
    changed_.notify_all();
  }
  /// False when no answer came within ten seconds: it never will.
  bool wait() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(10), [this] { return times_ > 0; });
  }
  int times() const {
    const std::lock_guard lock(mutex_);
    return times_;
  }
  bool ok() const { return value_.has_value(); }
  const T& value() const { return *value_; }
  std::optional<ErrorCode> code() const { return code_; }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<T> value_;
  std::optional<ErrorCode> code_;
  int times_ = 0;
};
using ChangeReply = Reply<server::SessionState>;
using StepReply = Reply<std::shared_ptr<const Answer>>;

class SessionEveryPlace : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override { begin(); }
  void TearDown() override {
    if (session_ != nullptr)
      session_->close({ErrorCode::kNotFound, server::Reason::kSessionNotFound, "gone"});
  }

  // GetParam(): threads of which a brief step may take its caller's.
  void begin() {
    TearDown();
    SceneDescription scene = grids_.scene();
    const std::uint32_t half = grids_.vertex_count() / 2;
    scene.bodies = {{"", 0, half}, {"", half, half}};
    server::PositionBuffer start(server::Dtype::kFloat64, scene.vertex_count);
    ASSERT_TRUE(start.append(bytes_of(0)).ok());
    session_ =
        Session::create({server::SessionId::parse("01234567-89ab-cdef-0123-456789abcdef").value(),
                         scene,
                         {},
                         server::Dtype::kFloat64,
                         0,
                         {}},
                        start,
                        {workers_, runner_, limits_, server::Account::open(budget_, 1 << 30, 0).value(),
                         [this](Session&, const Fault&) { lost_ = true; }})
            .value();
    frame_ = 0;
    lost_ = false;
  }

  /// Until the runner's threads, one a lane, have let go of everything that they ran before.
  void wait_for_runner() {
    for (const server::Lane lane : {server::Lane::kShort, server::Lane::kLong}) {
      std::promise<void> reached;
      runner_.post([&reached] { reached.set_value(); }, lane);
      reached.get_future().wait();
    }
  }

  std::string bytes_of(std::uint64_t frame) const {
    const std::vector<double> positions = grids_.positions(frame);
    return {reinterpret_cast<const char*>(positions.data()), positions.size() * sizeof(double)};
  }

  /// Sends a frame; null when that threw.
  std::shared_ptr<StepReply> send(std::uint64_t frame, long n) { return send(frame, n, bytes_of(frame)); }
  std::shared_ptr<StepReply> send(std::uint64_t frame, long n, const std::string& bytes) {
    FrameBuffer contents(server::Dtype::kFloat64, *session_->scene());
    EXPECT_TRUE(contents.append(bytes).ok());
    EXPECT_TRUE(contents.complete(*session_->scene()).ok());
    server::FramePass pass;
    pass.memory = server::Holding(session_->account(), contents.expected_bytes());
    const auto reply = std::make_shared<StepReply>();
    auto observer = tell_frame([reply](const server::FrameOutcome& outcome) { reply->take(outcome); });
    const FailingAllocations failing(n);
    try {
      session_->submit(
          {frame, server::FrameQuestion{std::move(contents)}, std::move(pass), std::move(observer)},
          Session::Admission::kAlways);
    } catch (const std::bad_alloc&) {
      return nullptr;
    }
    EXPECT_TRUE(reply->wait()) << "a frame without an answer";
    return reply;
  }

  static server::AddBody a_triangle() {
    server::AddBody add;
    add.addition.body.vertex_count = 3;
    add.addition.faces = {{0, 1, 2}};
    add.positions = {0.5, 0.5, -2, 1.5, 0.5, 2, 0.5, 1.5, -2};
    return add;
  }

  /// Of all kinds.
  static PairFilters all_filters(std::uint32_t vertices) {
    return {.within_edges = 2,
            .near_at_rest = 0.5,
            .rest_positions = std::vector<double>(std::size_t{3} * vertices, 0.25),
            .excluded_vertex_pairs = {{0, vertices - 1}, {1, 2}},
            .patches = std::vector<std::uint32_t>(vertices, 3)};
  }

  /// The reply to changes of which the n-th allocation fails; null when that threw.
  std::shared_ptr<ChangeReply> carry_out(server::ChangeOrder order, long n) {
    const auto reply = std::make_shared<ChangeReply>();
    auto observer =
        tell_change([reply](const Outcome<server::SessionState>& outcome) { reply->take(outcome); });
    const FailingAllocations failing(n);
    try {
      session_->change(std::move(order), std::move(observer));
    } catch (const std::bad_alloc&) {
      return nullptr;
    }
    EXPECT_TRUE(reply->wait()) << "a change without an answer";
    return reply;
  }

  /// The same of a change that adds a triangle; null when that threw.
  std::shared_ptr<ChangeReply> change(long n) { return carry_out({1, {a_triangle()}, "key"}, n); }

  /// Five changes as one, whose client gives up at the look-th look at its flag; of the n-th allocation as
  /// above.
  std::shared_ptr<ChangeReply> change_five(std::uint64_t next_frame, long look, long n = -1) {
    const server::AddBody add = a_triangle();
    Body rigid, removed, masked;
    rigid.kind = BodyKind::kRigid;
    removed.kind = BodyKind::kRemoved;
    masked.mask = 3;
    for (Body* body : {&rigid, &removed, &masked}) body->vertex_count = 1;
    const testing::CountedLooks counted(look);
    server::ChangeOrder order{next_frame,
                              {add, server::ChangeBody{0, rigid}, add, server::ChangeBody{2, removed},
                               server::ChangeBody{1, masked}},
                              "five"};
    order.given_up = {std::shared_ptr<void>(), const_cast<std::atomic<bool>*>(testing::CountedLooks::flag())};
    return carry_out(std::move(order), n);
  }

  void expect_answer(std::uint64_t frame) {
    const auto reply = send(frame, -1);
    ASSERT_NE(reply, nullptr);
    ASSERT_EQ(reply->times(), 1);
    ASSERT_TRUE(reply->ok()) << "code " << static_cast<int>(*reply->code());
    EXPECT_EQ(hash_of(*reply->value()), hashes_[frame - 1]) << "frame " << frame;
  }

  static constexpr std::uint64_t kFrames = 6;
  const MovingGrids grids_{kSide};
  const std::vector<std::uint64_t> hashes_ = local_hashes(grids_, 0, kFrames);
  server::Budget budget_{std::size_t{1} << 40};
  const server::Limits limits_;
  const std::shared_ptr<Workers> workers_ = std::make_shared<Workers>(1);
  server::Runner runner_{1, GetParam()};
  std::shared_ptr<Session> session_;
  std::uint64_t frame_ = 0;
  std::atomic<bool> lost_{false};
};
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
