// SPDX-License-Identifier: Apache-2.0
// A session's account equals the allocator's figure, in every state of a session with many contacts; and no
// step takes more memory than its bound.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdio>
#include <future>
#include <memory>
#include <vector>

#include "server/session/answer.h"
#include "server/session/session.h"
#include "server/transport/convert.h"
#include "server/transport/upload.h"
#include "tests/support/observers.h"
#include "tests/unit/server/bare_client.h"

namespace warmfront::test {
namespace {

std::size_t allocated() {
  const struct mallinfo2 all = mallinfo2();
  return all.uordblks + all.hblkhd;
}

/// Triangles that are apart and then all pass through each other.
class AccountsHoldTest : public ::testing::TestWithParam<bool> {
 protected:
  static constexpr std::uint32_t kTriangles = 120;

  AccountsHoldTest() {
    for (std::uint32_t i = 0; i < kTriangles; ++i)
      for (std::uint32_t corner = 0; corner < 3; ++corner) {
        const double x = corner == 1 ? 1.0 : 0.0, y = corner == 2 ? 1.0 : 0.0;
        for (std::vector<double>* const to : {&apart_, &through_}) to->insert(to->end(), {x, y});
        apart_.push_back(10.0 * i);
        through_.push_back(-1e-3 * i);
      }
    options_.front = FrontMode::kNone;  // which would keep contacts of its own, within its own bound
    if (GetParam()) options_.fields = {true, true, true};
  }
  std::shared_ptr<server::Session> make() {
    SceneDescription scene;
    scene.vertex_count = 3 * kTriangles;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(kTriangles); ++i)
      scene.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    server::PositionBuffer positions(server::Dtype::kFloat64, scene.vertex_count);
    EXPECT_TRUE(positions.append(bytes_of(apart_)).ok());
    return server::Session::create({server::SessionId::parse(kId).value(),
                                    std::move(scene),
                                    options_,
                                    server::Dtype::kFloat64,
                                    0,
                                    {}},
                                   positions,
                                   {.workers = workers_,
                                    .runner = runner_,
                                    .limits = limits_,
                                    .account = account_,
                                    .lost = [](server::Session&, const server::Fault&) {}})
        .value();
  }
  std::shared_ptr<const server::Answer> step(server::Session& session, std::uint64_t frame,
                                             const std::vector<double>& positions) {
    server::FrameBuffer contents(server::Dtype::kFloat64, *session.scene());
    static_cast<void>(contents.append(bytes_of(positions)));
    server::FramePass pass;
    pass.memory = server::Holding(account_, contents.expected_bytes());
    std::promise<server::Outcome<std::shared_ptr<const server::Answer>>> done;
    session.submit({frame, server::FrameQuestion{std::move(contents)}, std::move(pass),
                    tell_frame([&](const server::FrameOutcome& outcome) { done.set_value(outcome); })},
                   server::Session::Admission::kBounded);
    auto outcome = done.get_future().get();
    EXPECT_TRUE(outcome.ok()) << outcome.fault().message;
    // Its job has ended, and the session has updated its account.
    std::promise<void> ended;
    runner_.post([&] { ended.set_value(); }, server::Lane::kShort);
    ended.get_future().wait();
    std::promise<void> ended_too;
    runner_.post([&] { ended_too.set_value(); }, server::Lane::kLong);
    ended_too.get_future().wait();
    return outcome.ok() ? outcome.value() : nullptr;
  }
  /// As charged, and as allocated; what a thread or the runner allocated meanwhile is not the session's.
  void expect_enough(std::size_t before, const char* state) const {
    [[maybe_unused]] constexpr std::size_t kOthers = 256 << 10;
    const std::size_t is = allocated() - before, said = account_->held();
    std::printf("%s: %zu bytes are held, and the account says %zu\n", state, is, said);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    EXPECT_GE(said + kOthers, is) << state;
#endif
  }

  std::vector<double> apart_, through_;
  ColliderOptions options_;
  const std::shared_ptr<Workers> workers_ = std::make_shared<Workers>(1);
  server::Budget budget_{1 << 30};
  const std::shared_ptr<server::Account> account_ = server::Account::open(budget_, 1 << 30, 0).value();
  server::Limits limits_;
  server::Runner runner_{1};
};

TEST_P(AccountsHoldTest, ChargesAtLeastWhatTheAllocatorHolds) {
  {  // What the threads and the engine take once is taken.
    const auto warm_up = make();
    static_cast<void>(step(*warm_up, 1, apart_));
  }
  const std::size_t before = allocated();
  const auto session = make();
  expect_enough(before, "made");
  static_cast<void>(step(*session, 1, apart_));
  expect_enough(before, "stepped");
  const std::size_t idle = account_->held();
  std::shared_ptr<const server::Answer> answer = step(*session, 2, through_);
  ASSERT_TRUE(answer);
  ASSERT_GT(answer->rows(), 20'000u);
  expect_enough(before, "answered");
  // What a contact takes, as the account grew, and what it is encoded into.
  const double each = static_cast<double>(account_->held() - idle + answer->contact_bytes()) /
                      static_cast<double>(answer->rows());
  std::printf("a contact takes %.0f bytes, and is bounded by %zu\n", each,
              server::held_per_contact(options_.fields));
  constexpr double kNotOfContacts = 8;  // what else of a session grows with such a step
  EXPECT_LE(each, static_cast<double>(server::held_per_contact(options_.fields)) + kNotOfContacts);
  std::shared_ptr<const server::Answer> waiting = step(*session, 3, apart_);
  expect_enough(before, "with an answer that waits");
  answer.reset();
  waiting.reset();
  expect_enough(before, "with the answer taken");
}

TEST_P(AccountsHoldTest, AStepIsLimitedToItsShare) {
  server::Limits limits;
  limits.max_session_bytes = 32 << 20;
  v1::ColliderOptions wanted;
  wanted.mutable_fields()->set_weights(GetParam());
  wanted.mutable_fields()->set_normal(GetParam());
  wanted.mutable_fields()->set_points(GetParam());
  const auto options = server::options_from(wanted, limits);
  ASSERT_TRUE(options.ok());
  const std::size_t row =
      options.value().fields.any() ? 2 * (3 * 24 + 2 * 144) + 2 * 134 : 2 * (3 * 24) + 2 * 30;
  EXPECT_LE(options.value().max_contacts * row, limits.max_session_bytes / 2);
  EXPECT_GT((options.value().max_contacts + 1) * row, limits.max_session_bytes / 2);
}

/// What is allocated for `make`'s value.
template <class Make>
std::size_t allocated_by(Make make) {
  const std::size_t before = allocated();
  const auto kept = make();
  return allocated() - before;
}

TEST(AccountsOfWhatArrivesTest, AnUploadStaysWithinWhatIsReservedForIt) {
  const server::Limits limits;
  v1::CreateSessionRequest header, faces, positions;
  header.mutable_header()->set_session_id(kId);
  header.mutable_header()->set_vertex_count(100'000);
  header.mutable_header()->set_face_count(100'000);
  header.mutable_header()->set_dtype(v1::DTYPE_FLOAT64);
  faces.set_faces(std::string(12 * 1000, 'x'));
  positions.set_positions(std::string(24 * 1000, 'x'));
  std::size_t reserved = 0;
  const std::size_t is = allocated_by([&] {
    auto upload = std::make_unique<server::Upload>(limits);
    EXPECT_FALSE(upload->add(header));
    for (int part = 0; part < 100; ++part) EXPECT_FALSE(upload->add(faces) || upload->add(positions));
    EXPECT_FALSE(upload->complete());
    reserved = upload->estimate_bytes();
    return upload;
  });
  std::printf("an upload takes %zu bytes of %zu\n", is, reserved);
  EXPECT_GE(reserved, is);
}

TEST(AccountsOfWhatArrivesTest, AFrameThatWaitsIsChargedWhatItTakes) {
  constexpr std::uint32_t kVertices = 60'000;
  SceneDescription description;
  description.vertex_count = kVertices;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(kVertices); i += 3)
    description.faces.push_back({i, i + 1, i + 2});
  const Scene scene = Scene::create(std::move(description)).value();
  std::vector<std::uint32_t> vertices(kVertices / 2);
  for (std::uint32_t i = 0; i < vertices.size(); ++i) vertices[i] = 2 * i;
  const std::string indices(reinterpret_cast<const char*>(vertices.data()), 4 * vertices.size());
  const std::string rows = bytes_of(std::vector<double>(3 * vertices.size(), 1.0));
  server::Budget budget(1 << 30);
  const auto account = server::Account::open(budget, 1 << 30, 0).value();
  server::FramePass pass;
  const std::size_t is = allocated_by([&] {
    auto contents = std::make_unique<server::FrameBuffer>(server::Dtype::kFloat64, scene);
    pass.memory = server::Holding(account, contents->expected_bytes());
    for (std::size_t at = 0; at < vertices.size(); at += 100)
      EXPECT_TRUE(contents
                      ->append({.vertices = std::string_view(indices).substr(4 * at, 400),
                                .vertex_positions = std::string_view(rows).substr(24 * at, 2400)})
                      .ok());
    EXPECT_TRUE(contents->complete(scene).ok());
    pass.hold(contents->memory_bytes());
    return contents;
  });
  std::printf("a frame takes %zu bytes, and the account says %zu\n", is, account->held());
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_GE(account->held() + (32 << 10), is);
#endif
}

INSTANTIATE_TEST_SUITE_P(Fields, AccountsHoldTest, ::testing::Bool());

}  // namespace
}  // namespace warmfront::test
