// SPDX-License-Identifier: Apache-2.0
// The client library with shared memory and without: the same bits for everything that may be asked, in any
// number of messages, with several frames under way, and when the daemon dies.
#include <gtest/gtest.h>

#include <span>
#include <utility>
#include <vector>

#include "client/lib/any_session.h"
#include "client/lib/client.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {
namespace {

using client::Answer;
using client::Client;
using client::Session;
using Doubles = std::span<const double>;

void expect_same(const Result<Answer>& a, const Result<Answer>& b) {
  ASSERT_TRUE(a.ok()) << a.error().message;
  ASSERT_TRUE(b.ok()) << b.error().message;
  EXPECT_EQ(a.value().contacts, b.value().contacts);
  EXPECT_EQ(a.value().total(), b.value().total());
  EXPECT_EQ(a.value().possible, b.value().possible);
  EXPECT_EQ(a.value().earliest_toi, b.value().earliest_toi);
  EXPECT_EQ(a.value().vertex_distances, b.value().vertex_distances);
  EXPECT_EQ(a.value().frame, b.value().frame);
}

/// Of an answer's chunks, and of frames that are told of before their positions are written.
struct Bytes {
  std::size_t chunk;
  std::size_t early_frame;
};

class RemoteSharedMemoryTest : public ::testing::TestWithParam<Bytes> {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.answer_chunk_bytes = GetParam().chunk;
    return config;
  }
  static ColliderOptions all_fields() {
    ColliderOptions options;
    options.fields = {true, true, true, true, true, true};
    return options;
  }
  Client connect(bool shares) {
    return Client::connect(daemon_.address(),
                           {.shared_memory = shares, .early_frame_bytes = GetParam().early_frame})
        .value();
  }
  Session session(Client& client, const ColliderOptions& options = all_fields()) {
    const std::vector<double> start = grids_.positions(0);
    return client.create_session(grids_.scene(), Doubles(start), options).value();
  }

  LocalDaemon daemon_{config()};
  const MovingGrids grids_{24};
};

TEST_P(RemoteSharedMemoryTest, EveryQuestionHasTheSameAnswer) {
  Client without = connect(false), with = connect(true);
  Session stream = session(without), shared = session(with);
  std::size_t rows = 0;
  for (std::uint64_t frame = 1; frame <= 6; ++frame) {
    SCOPED_TRACE(frame);
    if (frame == 4) daemon_.restart();
    const std::vector<double> next = grids_.positions(frame);
    const auto near_a = stream.proximity(0.5, Where::kBase, {.reduced = true});
    expect_same(near_a, shared.proximity(0.5, Where::kBase, {.reduced = true}));
    rows += near_a.value().contacts.size();
    expect_same(stream.vertex_distances(0.3), shared.vertex_distances(0.3));
    expect_same(stream.trial(Frame(Doubles(next))), shared.trial(Frame(Doubles(next))));
    expect_same(stream.intersections(Where::kTrialEnd), shared.intersections(Where::kTrialEnd));
    const auto far_a = stream.max_step(Frame(Doubles(next)));
    const auto far_b = shared.max_step(Frame(Doubles(next)));
    ASSERT_TRUE(far_a.ok() && far_b.ok());
    EXPECT_EQ(far_a.value().fraction, far_b.value().fraction);
    const auto part_a = stream.commit(0.25), part_b = shared.commit(0.25);
    ASSERT_TRUE(part_a.ok() && part_b.ok());
    EXPECT_EQ(part_a.value().vf, part_b.value().vf);
    const std::vector<std::uint32_t> vertices{3, 1, 100};
    const std::vector<double> elsewhere{0, 0, 1, 1, 0, 2, 2, 2, 1};
    Frame few;
    few.vertices = vertices;
    few.vertex_positions = Doubles(elsewhere);
    expect_same(stream.step(few), shared.step(few));
    for (const Report report : {Report::kAll, Report::kEarliest, Report::kCount, Report::kCandidates})
      expect_same(stream.trial(Frame(Doubles(next)), {.report = report}),
                  shared.trial(Frame(Doubles(next)), {.report = report}));
    expect_same(stream.step(Frame(Doubles(next))), shared.step(Frame(Doubles(next))));
  }
  EXPECT_GT(rows, 1000U) << "more than the room that there is at first";
  EXPECT_EQ(shared.resumes(), 1U);
  EXPECT_GT(with.get_session(shared.id()).value().memory_bytes,
            without.get_session(stream.id()).value().memory_bytes + (std::uint64_t{128} << 10))
      << "the memory is charged";
}

// Enough of it to be put there.
TEST_P(RemoteSharedMemoryTest, WhatMovedHasTheSameAnswer) {
  Client without = connect(false), with = connect(true);
  SceneDescription scene = grids_.scene();
  const std::uint32_t half = grids_.vertex_count() / 2;
  scene.bodies = {{"below", 0, half, BodyKind::kRigid}, {"above", half, half}};
  const std::vector<double> start = grids_.positions(0);
  Session stream = without.create_session(scene, Doubles(start), all_fields()).value();
  Session shared = with.create_session(scene, Doubles(start), all_fields()).value();
  std::size_t rows = 0;
  for (std::uint64_t frame = 1; frame <= 6; ++frame) {
    SCOPED_TRACE(frame);
    if (frame == 4) daemon_.restart();
    const std::vector<double> next = grids_.positions(frame);
    const Doubles above = Doubles(next).subspan(std::size_t{3} * half);
    Frame moved;
    const std::vector<BodyPositions> bodies{{1, above}};
    std::vector<std::uint32_t> vertices;
    if (frame % 2 == 0) {
      moved.bodies = bodies;
    } else {
      for (std::uint32_t v = half; v < 2 * half; ++v) vertices.push_back(v);
      moved.vertices = vertices;
      moved.vertex_positions = above;
    }
    Pose pose;
    pose.matrix[3] = 0.01 * static_cast<double>(frame);
    const std::vector<BodyPose> poses{{0, pose}};
    moved.poses = poses;
    const auto a = stream.trial(moved);
    expect_same(a, shared.trial(moved));
    rows += a.value().contacts.size();
    const auto part_a = stream.commit(0.5), part_b = shared.commit(0.5);
    ASSERT_TRUE(part_a.ok() && part_b.ok());
    expect_same(stream.step(moved), shared.step(moved));
  }
  EXPECT_GT(rows, 100U);
  EXPECT_EQ(shared.resumes(), 1U);
}

TEST_P(RemoteSharedMemoryTest, SeveralFramesUnderWayAndErrorsAmongThem) {
  Client without = connect(false), with = connect(true);
  Session stream = session(without), shared = session(with);
  for (std::uint64_t frame = 1; frame <= 9; frame += 3) {
    if (frame == 7) daemon_.restart();
    for (Session* one : {&stream, &shared}) {
      ASSERT_GE(one->window(), 3U);
      for (std::uint64_t k = 0; k < 3; ++k)
        ASSERT_TRUE(one->submit(Frame(Doubles(grids_.positions(frame + k)))).ok());
    }
    for (int k = 0; k < 3; ++k) expect_same(stream.next_answer(), shared.next_answer());
    std::vector<double> bad = grids_.positions(1);
    bad[5] = std::numeric_limits<double>::quiet_NaN();
    const auto a = stream.step(Frame(Doubles(bad))), b = shared.step(Frame(Doubles(bad)));
    ASSERT_FALSE(a.ok() || b.ok());
    EXPECT_EQ(a.error().code, b.error().code);
    EXPECT_EQ(a.error().message, b.error().message);
  }
}

TEST_P(RemoteSharedMemoryTest, ADaemonThatNoLongerOffersItIsFollowed) {
  Client with = connect(true), without = connect(false);
  Session shared = session(with), stream = session(without);
  for (std::uint64_t frame = 1; frame <= 6; ++frame) {
    if (frame > 1) daemon_.restart([&](server::Config& config) { config.no_shared_memory = frame % 2 == 0; });
    const std::vector<double> next = grids_.positions(frame);
    expect_same(stream.step(Frame(Doubles(next))), shared.step(Frame(Doubles(next))));
  }
}

INSTANTIATE_TEST_SUITE_P(Bytes, RemoteSharedMemoryTest,
                         ::testing::Values(Bytes{64, 0}, Bytes{std::size_t{1} << 20, std::size_t{1} << 30},
                                           Bytes{std::size_t{1} << 20, 0}));

}  // namespace
}  // namespace warmfront::test
