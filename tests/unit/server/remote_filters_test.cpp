// SPDX-License-Identifier: Apache-2.0
// Pair filters of sessions behind a daemon: the same answers as in this process, for any scenes and filters,
// and also when the daemon dies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "client/lib/any_session.h"
#include "tests/support/draws.h"
#include "tests/support/pair_rules.h"
#include "tests/support/scenes.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {
namespace {

using client::AnySession;
using client::Client;
using ::testing::HasSubstr;
using Doubles = std::span<const double>;

/// Draws scenes and filters, and asks a session in this process and one behind a daemon the same.
class Pair : public testing::Draws {
 public:
  Pair(std::uint64_t seed, Client& client) : Draws(seed) {
    const testing::RandomScene made = testing::random_scene(random_);
    scene_.vertex_count = made.scene->vertex_count();
    for (const Face& face : made.scene->faces())
      scene_.faces.push_back({static_cast<std::int32_t>(face[0]), static_cast<std::int32_t>(face[1]),
                              static_cast<std::int32_t>(face[2])});
    scene_.bodies = {{"all", 0, scene_.vertex_count}};
    x_ = made.positions;
    scene_.filters = draw_filters();
    const ColliderOptions options{.min_separation = below(2) == 0 ? 0.02 : 0};
    both_.push_back(AnySession::create(scene_, Doubles(x_), options).value());
    both_.emplace_back(client.create_session(scene_, Doubles(x_), options).value());
    SceneDescription without = scene_;
    without.filters = {};
    both_.push_back(AnySession::create(without, Doubles(x_), options).value());
    scene_.filters.rest_at(Doubles(x_));
  }

  void act() {
    if (below(4) == 0) change_filters();
    if (below(4) == 0) add_body();
    move();
  }
  std::uint64_t left_out() const { return left_out_; }

 private:
  PairFilters draw_filters() {
    PairFilters filters;
    const int n = static_cast<int>(scene_.vertex_count);
    if (below(2) == 0) filters.within_edges = static_cast<std::uint32_t>(below(4));
    if (below(2) == 0) filters.near_at_rest = 0.1 * (1 + below(4));
    for (int i = below(6); i > 0; --i) {
      const auto a = static_cast<std::uint32_t>(below(n)), b = static_cast<std::uint32_t>(below(n));
      if (a != b) filters.excluded_vertex_pairs.push_back({a, b});
    }
    if (below(2) == 0)
      for (int v = 0; v < n; ++v)
        filters.patches.push_back(static_cast<std::uint32_t>(below(8) == 0 ? 0 : 1));
    return filters;
  }

  void change_filters() {
    scene_.filters = draw_filters();
    scene_.filters.rest_at(Doubles(x_));
    for (int i : {0, 1}) ASSERT_TRUE(both_[i].change_filters(scene_.filters).ok());
  }

  void add_body() {
    const testing::RandomScene made = testing::random_scene(random_);
    BodyAddition addition{{"", 0, made.scene->vertex_count()}, {}};
    for (const Face& face : made.scene->faces())
      addition.faces.push_back({static_cast<std::int32_t>(face[0]), static_cast<std::int32_t>(face[1]),
                                static_cast<std::int32_t>(face[2])});
    for (AnySession& session : both_) ASSERT_TRUE(session.add_body(addition, Doubles(made.positions)).ok());
    const auto first = static_cast<std::int32_t>(scene_.vertex_count);
    for (const auto& face : addition.faces)
      scene_.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
    addition.body.first_vertex = scene_.vertex_count;
    scene_.bodies.push_back(addition.body);
    scene_.vertex_count += addition.body.vertex_count;
    scene_.filters.append_body(addition.body.vertex_count, made.positions);
    x_.insert(x_.end(), made.positions.begin(), made.positions.end());
  }

  void move() {
    const Scene scene = Scene::create(scene_).value();
    const std::vector<double> y = testing::random_motion(random_, scene, x_);
    const testing::PairRules rules(scene, scene_.filters);
    expect_same(scene, rules, [&](AnySession& session) { return session.step(Frame{Doubles(y)}); });
    expect_same(scene, rules, [&](AnySession& session) { return session.proximity(0.1); });
    x_ = y;
  }

  template <class Ask>
  void expect_same(const Scene& scene, const testing::PairRules& rules, Ask ask) {
    const auto here = ask(both_[0]), there = ask(both_[1]), all = ask(both_[2]);
    ASSERT_TRUE(here.ok() && there.ok() && all.ok());
    EXPECT_EQ(here.value().contacts, there.value().contacts);
    EXPECT_EQ(here.value().vf, there.value().vf);
    EXPECT_EQ(here.value().ee, there.value().ee);
    const StepCounts& local = here.value().statistics.counts;
    const StepCounts& remote = there.value().statistics.counts;
    EXPECT_EQ(local.feature_pairs_filtered, remote.feature_pairs_filtered);
    EXPECT_EQ(local.triangle_pairs_filtered, remote.triangle_pairs_filtered);
    // Of all pairs, those that no rule leaves out.
    const client::ContactTable& table = all.value().contacts;
    std::size_t counted = 0;
    for (std::size_t i = 0; i < table.size(); ++i) {
      if (rules.leave_out(contact_of(scene, table, i))) {
        ++left_out_;
      } else {
        ASSERT_LT(counted, there.value().contacts.size());
        EXPECT_EQ(table.vertices[i], there.value().contacts.vertices[counted]);
        EXPECT_EQ(table.toi[i], there.value().contacts.toi[counted]);
        ++counted;
      }
    }
    EXPECT_EQ(counted, there.value().contacts.size());
  }

  // The features, by number, whose vertices a row has: any of those that are the same.
  static Contact contact_of(const Scene& scene, const client::ContactTable& table, std::size_t row) {
    const auto& v = table.vertices[row];
    const auto edge = [&](std::uint32_t a, std::uint32_t b) {
      const Edge wanted{std::min(a, b), std::max(a, b)};
      return static_cast<std::uint32_t>(std::ranges::lower_bound(scene.edges(), wanted) -
                                        scene.edges().begin());
    };
    Contact contact{table.kind[row], table.status[row], 0, 0, table.toi[row]};
    if (contact.kind == ContactKind::kVertexFace) {
      contact.a = v[0];
      contact.b = static_cast<std::uint32_t>(std::ranges::find(scene.faces(), Face{v[1], v[2], v[3]}) -
                                             scene.faces().begin());
    } else {
      const bool point_a = contact.kind != ContactKind::kEdgeEdge,
                 point_b = contact.kind == ContactKind::kVertexVertex;
      contact.a = point_a ? v[0] : edge(v[0], v[1]);
      contact.b = point_b ? v[2] : edge(v[2], v[3]);
    }
    return contact;
  }

  SceneDescription scene_;
  std::vector<double> x_;
  std::vector<AnySession> both_;  // in this process, behind a daemon, and in this process without filters
  std::uint64_t left_out_ = 0;
};

TEST(RemoteFiltersTest, AnswerAsInThisProcess) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  std::uint64_t left_out = 0;
  for (std::uint64_t seed = 0; seed < 25 && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    Pair pair(seed, client);
    for (int k = 0; k < 5; ++k) pair.act();
    left_out += pair.left_out();
  }
  EXPECT_GT(left_out, 100u);
}

TEST(RemoteFiltersTest, AreThereAgainAfterTheDaemonsRestart) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const MovingGrids grids(6);
  SceneDescription scene = grids.scene();
  scene.bodies = {{"", 0, grids.vertex_count() / 2},
                  {"", grids.vertex_count() / 2, grids.vertex_count() / 2}};
  scene.filters = {.within_edges = 1, .near_at_rest = 0.5, .patches = std::vector<std::uint32_t>(72, 1)};
  // No node of a hierarchy is in one patch, so that what is left out is reached, and counted.
  for (std::size_t v = 0; v < 72; v += 5) scene.filters.patches[v] = 0;
  const std::vector<double> start = grids.positions(0);
  for (const bool single : {false, true}) {
    const std::vector<float> floats(start.begin(), start.end());
    const Positions positions =
        single ? Positions(std::span<const float>(floats)) : Positions(Doubles(start));
    AnySession here = AnySession::create(scene, positions, {}).value();
    client::Session there = client.create_session(scene, positions).value();
    std::uint64_t frame = 0;
    std::vector<double> triangle = {9, 9, 9, 10, 9, 9, 9, 10, 9};
    const std::vector<float> triangle_floats(triangle.begin(), triangle.end());
    const Positions corners =
        single ? Positions(std::span<const float>(triangle_floats)) : Positions(Doubles(triangle));
    std::size_t added = 0;
    const auto same = [&] {
      std::vector<double> doubles = grids.positions(++frame);
      for (std::size_t i = 0; i < added; ++i) doubles.insert(doubles.end(), triangle.begin(), triangle.end());
      const std::vector<float> moved(doubles.begin(), doubles.end());
      const Frame to = single ? Frame(std::span<const float>(moved)) : Frame(Doubles(doubles));
      const auto a = here.step(to), b = there.step(to);
      ASSERT_TRUE(a.ok()) << a.error().message;
      ASSERT_TRUE(b.ok()) << b.error().message;
      EXPECT_EQ(a.value().contacts, b.value().contacts);
      const StepCounts& counts = b.value().statistics.counts;
      EXPECT_GT(counts.triangle_pairs_filtered + counts.feature_pairs_filtered, 0u);
    };
    same();
    daemon.restart();
    same();
    const BodyAddition addition{{"", 0, 3}, {{0, 1, 2}}};
    ASSERT_TRUE(here.add_body(addition, corners).ok());
    ASSERT_TRUE(there.add_body(addition, corners).ok());
    ++added;
    daemon.restart();
    same();
    EXPECT_EQ(client.get_session(there.id()).value().vertex_count, 75u);
    const PairFilters pairs{.within_edges = 2, .excluded_vertex_pairs = {{0, 36}, {1, 37}}};
    ASSERT_TRUE(here.change_filters(pairs).ok());
    ASSERT_TRUE(there.change_filters(pairs).ok());
    daemon.restart();
    same();
    EXPECT_EQ(there.resumes(), 3u);
    const client::SessionInfo::Filters filters = client.get_session(there.id()).value().filters;
    EXPECT_EQ(filters.within_edges, 2u);
    EXPECT_EQ(filters.near_at_rest, 0);
    EXPECT_EQ(filters.excluded_vertex_pairs, 2u);
    EXPECT_FALSE(filters.patches);
    const Status bad = there.change_filters({.patches = {1, 2}});
    EXPECT_EQ(bad.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(bad.error().message.substr(bad.error().message.find("filters.")),
              here.change_filters({.patches = {1, 2}}).error().message);
    same();
  }
}

TEST(RemoteFiltersTest, WhatIsWrongAtTheStartHasTheSameCode) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const MovingGrids grids(6);
  const std::vector<double> start = grids.positions(0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const PairFilters& filters :
       {PairFilters{.within_edges = 4}, PairFilters{.near_at_rest = nan}, PairFilters{.near_at_rest = -1},
        PairFilters{.near_at_rest = 1, .rest_positions = {1, 2}}, PairFilters{.rest_positions = {1, 2, 3}},
        PairFilters{.excluded_vertex_pairs = {{0, 72}}}, PairFilters{.patches = {1}}}) {
    SceneDescription scene = grids.scene();
    scene.filters = filters;
    const auto here = AnySession::create(scene, Doubles(start));
    const auto there = client.create_session(scene, Doubles(start));
    ASSERT_FALSE(here.ok());
    ASSERT_FALSE(there.ok());
    EXPECT_EQ(here.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(there.error().code, ErrorCode::kInvalidArgument) << there.error().message;
    EXPECT_THAT(there.error().message, HasSubstr("filters."));
  }
  EXPECT_TRUE(client.list_sessions().value().empty());
}

}  // namespace
}  // namespace warmfront::test
