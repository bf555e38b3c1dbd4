// SPDX-License-Identifier: Apache-2.0
// Worlds behind a daemon: the same answers as in this process, in any number of messages, also when the
// daemon dies.
#include <gtest/gtest.h>

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "client/lib/any_session.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {
namespace {

using client::AnySession;
using client::Client;
using Doubles = std::span<const double>;

constexpr std::uint32_t kWorlds = 12;

/// The grids once for each world, and a triangle that is in all.
SceneDescription in_worlds(const MovingGrids& grids) {
  SceneDescription scene;
  const SceneDescription one = grids.scene();
  const std::uint32_t half = grids.vertex_count() / 2;
  for (std::uint32_t world = 1; world <= kWorlds; ++world) {
    for (auto face : one.faces) {
      for (auto& v : face) v += static_cast<std::int32_t>(scene.vertex_count);
      scene.faces.push_back(face);
    }
    for (const std::uint32_t first : {0U, half}) {
      Body body{"", scene.vertex_count + first, half};
      body.world = world;
      scene.bodies.push_back(body);
    }
    scene.vertex_count += grids.vertex_count();
  }
  const auto first = static_cast<std::int32_t>(scene.vertex_count);
  scene.faces.push_back({first, first + 1, first + 2});
  scene.bodies.push_back({"", scene.vertex_count, 3, BodyKind::kStatic});
  scene.vertex_count += 3;
  return scene;
}

std::vector<double> positions(const MovingGrids& grids, std::uint64_t frame) {
  std::vector<double> all;
  for (std::uint32_t world = 0; world < kWorlds; ++world) {
    const std::vector<double> one = grids.positions(frame + world);
    all.insert(all.end(), one.begin(), one.end());
  }
  all.insert(all.end(), {-1, -1, -50, 1, -1, -50, 0, 1, -50});
  return all;
}

TEST(RemoteWorldsTest, AnswersAsInThisProcessAndAfterRestarts) {
  for (const std::size_t chunk : {std::size_t{64}, std::size_t{1} << 20}) {
    server::Config config;
    config.limits.answer_chunk_bytes = chunk;
    LocalDaemon daemon(config);
    Client client = Client::connect(daemon.address()).value();
    const MovingGrids grids(6);
    const SceneDescription scene = in_worlds(grids);
    const std::vector<double> start = positions(grids, 0);
    AnySession here = AnySession::create(scene, Doubles(start), {}).value();
    client::Session there = client.create_session(scene, Doubles(start)).value();
    EXPECT_EQ(client.get_session(there.id()).value().world_count, kWorlds);
    std::uint64_t contacts = 0;
    for (std::uint64_t frame = 1; frame <= 3; ++frame) {
      daemon.restart();
      const std::vector<double> next = positions(grids, frame);
      const QuestionOptions earliest{.report = Report::kEarliest};
      const auto a = here.trial(Frame(Doubles(next)), earliest), b = there.trial(Frame(Doubles(next)), earliest);
      ASSERT_TRUE(a.ok()) << a.error().message;
      ASSERT_TRUE(b.ok()) << b.error().message;
      EXPECT_EQ(a.value().contacts, b.value().contacts);
      EXPECT_EQ(a.value().worlds.size(), kWorlds + 1);
      EXPECT_EQ(a.value().worlds, b.value().worlds);
      EXPECT_EQ(a.value().world_tois, b.value().world_tois);
      const auto far_here = here.max_step(Frame(Doubles(next))), far_there = there.max_step(Frame(Doubles(next)));
      ASSERT_TRUE(far_there.ok()) << far_there.error().message;
      EXPECT_EQ(far_here.value().world_fractions, far_there.value().world_fractions);
      EXPECT_EQ(far_there.value().world_fractions.size(), kWorlds + 1);
      const auto c = here.step(Frame(Doubles(next))), d = there.step(Frame(Doubles(next)));
      ASSERT_TRUE(d.ok()) << d.error().message;
      EXPECT_EQ(c.value().contacts, d.value().contacts);
      EXPECT_TRUE(d.value().worlds.empty());
      contacts += a.value().contacts.size();
    }
    EXPECT_GT(contacts, 0U);
    EXPECT_EQ(there.resumes(), 3U);
  }
}

}  // namespace
}  // namespace warmfront::test
