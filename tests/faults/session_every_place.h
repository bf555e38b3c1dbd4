// SPDX-License-Identifier: Apache-2.0
// A daemon's session whose requests meet failing allocations, and what an observer of it was told.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/session/session.h"
#include "tests/support/counted_looks.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/observers.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {

inline std::uint64_t hash_of(const server::Answer& answer) {
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
  void take(const server::Outcome<T>& outcome) {
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
using StepReply = Reply<std::shared_ptr<const server::Answer>>;

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
    session_ = server::Session::create(
                   {server::SessionId::parse("01234567-89ab-cdef-0123-456789abcdef").value(),
                    scene,
                    {},
                    server::Dtype::kFloat64,
                    0,
                    {}},
                   start,
                   {workers_, runner_, limits_, server::Account::open(budget_, 1 << 30, 0).value(),
                    [this](server::Session&, const server::Fault&) { lost_ = true; }})
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
    server::FrameBuffer contents(server::Dtype::kFloat64, *session_->scene());
    EXPECT_TRUE(contents.append(bytes).ok());
    EXPECT_TRUE(contents.complete(*session_->scene()).ok());
    server::FramePass pass;
    pass.memory = server::Holding(session_->account(), contents.expected_bytes());
    const auto reply = std::make_shared<StepReply>();
    auto observer = tell_frame([reply](const server::FrameOutcome& outcome) { reply->take(outcome); });
    const testing::FailingAllocations failing(n);
    try {
      session_->submit(
          {frame, server::FrameQuestion{std::move(contents)}, std::move(pass), std::move(observer)},
          server::Session::Admission::kAlways);
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
        tell_change([reply](const server::Outcome<server::SessionState>& outcome) { reply->take(outcome); });
    const testing::FailingAllocations failing(n);
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
  const MovingGrids grids_{4};
  const std::vector<std::uint64_t> hashes_ = local_hashes(grids_, 0, kFrames);
  server::Budget budget_{std::size_t{1} << 40};
  const server::Limits limits_{};
  const std::shared_ptr<Workers> workers_ = std::make_shared<Workers>(1);
  server::Runner runner_{1, {GetParam()}};
  std::shared_ptr<server::Session> session_;
  std::uint64_t frame_ = 0;
  std::atomic<bool> lost_{false};
};

}  // namespace warmfront::test
