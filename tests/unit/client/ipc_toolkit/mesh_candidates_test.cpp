// SPDX-License-Identifier: Apache-2.0
// The candidates that IPC Toolkit is given, without it: none that the exact test finds is missing, whatever
// was asked before; none is listed that boxes tell apart.
#include "client/ipc_toolkit/mesh_candidates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "engine/pair_test.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront::ipc_toolkit {
namespace {

using Pairs = std::set<std::pair<std::int32_t, std::int32_t>>;
using Corners = std::array<std::int32_t, 4>;  // a pair's vertices, in the order of test_pair()

enum class Kind { kEdgeEdge, kFaceVertex, kEdgeVertex, kVertexVertex };
constexpr std::array kKinds{Kind::kEdgeEdge, Kind::kFaceVertex, Kind::kEdgeVertex, Kind::kVertexVertex};

/// A crumpled sheet, a strand above it, and points, of which the last two are in no element.
class MeshCandidatesTest : public ::testing::Test {
 protected:
  static constexpr int kSide = 4;

  MeshCandidatesTest() {
    mesh_.faces = testing::grid(kSide);
    const int sheet = (kSide + 1) * (kSide + 1);
    std::set<std::array<std::int32_t, 2>> sides;
    for (const auto& f : mesh_.faces)
      for (int k = 0; k < 3; ++k)
        sides.insert({std::min(f[k], f[(k + 1) % 3]), std::max(f[k], f[(k + 1) % 3])});
    mesh_.edges.assign(sides.begin(), sides.end());
    for (int k = 0; k < 5; ++k) mesh_.edges.push_back({sheet + k + 1, sheet + k});  // the strand
    std::shuffle(mesh_.edges.begin(), mesh_.edges.end(), random_);
    mesh_.vertex_count = static_cast<std::size_t>(sheet + 6 + 2);
  }

  std::vector<double> drawn_state(double way) {
    std::vector<double> x;
    for (int i = 0; i <= kSide; ++i)
      for (int j = 0; j <= kSide; ++j) x.insert(x.end(), {0.3 * i, 0.3 * j, 0.0});
    for (int k = 0; k < 6; ++k) x.insert(x.end(), {0.2 * k, 0.6, 0.1});
    x.insert(x.end(), {0.5, 0.5, 0.05, 0.5, 0.55, 0.05});
    std::uniform_real_distribution<double> by(-way, way);
    for (double& coordinate : x) coordinate += by(random_);
    return x;
  }

  MeshCandidates fresh() const { return MeshCandidates::create(mesh_, testing::workers()).value(); }

  static Pairs listed(MeshCandidates& candidates, Kind kind) {
    Pairs pairs;
    const auto take = [&](std::int32_t a, std::int32_t b) {
      EXPECT_TRUE(pairs.insert({a, b}).second) << "listed twice";
    };
    if (kind == Kind::kEdgeEdge) candidates.edge_edge(take);
    if (kind == Kind::kFaceVertex) candidates.face_vertex(take);
    if (kind == Kind::kEdgeVertex) candidates.edge_vertex(take);
    if (kind == Kind::kVertexVertex) candidates.vertex_vertex(take);
    return pairs;
  }

  /// Calls look(a, b, corners) for all pairs of the kind that share no vertex.
  void for_all(Kind kind, const std::function<void(std::int32_t, std::int32_t, const Corners&)>& look) const {
    const auto count = [](const auto& list) { return static_cast<std::int32_t>(list.size()); };
    const auto n = static_cast<std::int32_t>(mesh_.vertex_count);
    const std::int32_t firsts = kind == Kind::kFaceVertex     ? count(mesh_.faces)
                                : kind == Kind::kVertexVertex ? n
                                                              : count(mesh_.edges);
    for (std::int32_t a = 0; a < firsts; ++a) {
      const bool same_kind = kind == Kind::kEdgeEdge || kind == Kind::kVertexVertex;
      for (std::int32_t b = same_kind ? a + 1 : 0; b < (kind == Kind::kEdgeEdge ? firsts : n); ++b) {
        Corners corners{a, a, b, b};
        if (kind == Kind::kFaceVertex) corners = {b, mesh_.faces[a][0], mesh_.faces[a][1], mesh_.faces[a][2]};
        if (kind == Kind::kEdgeVertex) corners = {b, b, mesh_.edges[a][0], mesh_.edges[a][1]};
        if (kind == Kind::kEdgeEdge)
          corners = {mesh_.edges[a][0], mesh_.edges[a][1], mesh_.edges[b][0], mesh_.edges[b][1]};
        const int first = kind == Kind::kFaceVertex ? 1 : 2;
        bool shared = false;
        for (int i = 0; i < first; ++i)
          for (int j = first; j < 4; ++j) shared |= corners[i] == corners[j];
        if (!shared) look(a, b, corners);
      }
    }
  }

  static MovingPair moving(Kind kind, const Corners& corners, const MotionOrState& asked) {
    MovingPair pair{kind == Kind::kFaceVertex ? ContactKind::kVertexFace : ContactKind::kEdgeEdge, {}, {}};
    const std::vector<double>& end = asked.end.empty() ? asked.start : asked.end;
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        pair.start[k][axis] = asked.start[3 * static_cast<std::size_t>(corners[k]) + axis];
        pair.end[k][axis] = end[3 * static_cast<std::size_t>(corners[k]) + axis];
      }
    }
    return pair;
  }

  static bool boxes_meet(const MovingPair& pair, double separation) {
    const std::size_t first = pair.kind == ContactKind::kVertexFace ? 1 : 2;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::array<double, 2> lo{1e9, 1e9};
      std::array<double, 2> hi{-1e9, -1e9};
      for (std::size_t k = 0; k < 4; ++k) {
        for (const double x : {pair.start[k][axis], pair.end[k][axis]}) {
          lo[k >= first] = std::min(lo[k >= first], x);
          hi[k >= first] = std::max(hi[k >= first], x);
        }
      }
      if (lo[0] - hi[1] > separation + 1e-12 || lo[1] - hi[0] > separation + 1e-12) return false;
    }
    return true;
  }

  /// Asks, looks at each kind, and counts the pairs that must be there.
  int expect_right(MeshCandidates& candidates, const MotionOrState& asked) {
    candidates.ask_about(asked);
    int near = 0;
    for (const Kind kind : kKinds) {
      const Pairs pairs = listed(candidates, kind);
      std::size_t among = 0;
      for_all(kind, [&](std::int32_t a, std::int32_t b, const Corners& corners) {
        const MovingPair pair = moving(kind, corners, asked);
        const bool is_listed = pairs.contains({a, b});
        among += is_listed;
        const bool is_near =
            test_pair(pair, {.tier = Tier::kExact, .min_separation = asked.separation}).value().has_value();
        near += is_near;
        EXPECT_TRUE(is_listed || !is_near) << "kind " << static_cast<int>(kind) << ": " << a << ", " << b;
        EXPECT_TRUE(!is_listed || boxes_meet(pair, asked.separation));
      });
      EXPECT_EQ(among, pairs.size()) << "a pair that shares a vertex, or is listed the other way round";
    }
    return near;
  }

  Mesh mesh_;
  std::mt19937_64 random_{3};
};

TEST_F(MeshCandidatesTest, MissNothingWhateverIsAskedInWhateverOrder) {
  MeshCandidates warm = fresh();
  std::vector<double> at = drawn_state(0.1);
  std::vector<double> next = drawn_state(0.1);
  int near = 0;
  for (int k = 0; k < 60; ++k) {
    MotionOrState asked;
    asked.separation = std::array{0.0, 0.02, 0.3}[random_() % 3];
    switch (random_() % 6) {
      case 0:
        asked.start = at = drawn_state(0.1);
        break;  // stands elsewhere
      case 1:   // stands nearby
        for (double& x : at) x += 1e-3 * std::uniform_real_distribution<double>(-1, 1)(random_);
        asked.start = at;
        break;
      case 2:
        asked.start = next;
        break;  // stands where the last motion ended
      case 3:   // goes on from there
        at = next;
        [[fallthrough]];
      case 4:  // another motion from where it stands
        asked.start = at;
        asked.end = next = drawn_state(0.1);
        break;
      default:  // from somewhere else
        asked.start = at = drawn_state(0.2);
        asked.end = next = drawn_state(0.2);
    }
    near += expect_right(warm, asked);
    MeshCandidates cold = fresh();
    cold.ask_about(asked);
    for (const Kind kind : kKinds) EXPECT_EQ(listed(warm, kind), listed(cold, kind)) << "question " << k;
    if (::testing::Test::HasFailure()) break;
  }
  EXPECT_GT(near, 10'000);
}

TEST_F(MeshCandidatesTest, GoBackToWhereMotionsBegan) {
  MeshCandidates candidates = fresh();
  const std::vector<double> a = drawn_state(0.2), b = drawn_state(0.2), c = drawn_state(0.2);
  for (const auto& [from, to] :
       {std::pair(a, b), std::pair(b, c), std::pair(a, c), std::pair(c, a), std::pair(b, a)})
    EXPECT_GT(expect_right(candidates, {from, to, 0}), 0);
}

// On a grid everything touches, or is apart by exactly the separation.
TEST_F(MeshCandidatesTest, HoldWhatTouches) {
  MeshCandidates candidates = fresh();
  int near = 0;
  for (const double separation : {0.0, 0.25}) {
    for (int k = 0; k < 10; ++k) {
      MotionOrState asked{drawn_state(0.3), k % 2 == 0 ? std::vector<double>() : drawn_state(0.3),
                          separation};
      for (double& x : asked.start) x = std::round(4 * x) / 4;
      for (double& x : asked.end) x = std::round(4 * x) / 4;
      near += expect_right(candidates, asked);
    }
  }
  EXPECT_GT(near, 10'000);
}

TEST_F(MeshCandidatesTest, TwoDimensionsAreAPlane) {
  MeshCandidates candidates = fresh();
  int near = 0;
  for (int k = 0; k < 10; ++k) {
    MotionOrState asked{drawn_state(0.2), drawn_state(0.2), k % 2 * 0.05};
    for (auto* positions : {&asked.start, &asked.end})
      for (std::size_t i = 2; i < positions->size(); i += 3) (*positions)[i] = 0;
    near += expect_right(candidates, asked);
  }
  EXPECT_GT(near, 1'000);
}

/// Does the edge pass through the face, well within both?
bool pierces(const std::vector<double>& x, const std::array<std::int32_t, 2>& edge,
             const std::array<std::int32_t, 3>& face) {
  const auto at = [&](std::int32_t v) {
    return std::array{x[3 * static_cast<std::size_t>(v)], x[3 * static_cast<std::size_t>(v) + 1],
                      x[3 * static_cast<std::size_t>(v) + 2]};
  };
  const auto volume = [&](std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) {
    std::array<std::array<double, 3>, 3> m{};
    for (std::size_t k = 0; k < 3; ++k)
      m[0][k] = at(b)[k] - at(a)[k], m[1][k] = at(c)[k] - at(a)[k], m[2][k] = at(d)[k] - at(a)[k];
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  };
  constexpr double kClear = 1e-9;
  const double p = volume(edge[0], face[0], face[1], face[2]);
  const double q = volume(edge[1], face[0], face[1], face[2]);
  if (!(std::min(p, q) < -kClear && std::max(p, q) > kClear)) return false;
  const double u = volume(edge[0], edge[1], face[0], face[1]);
  const double v = volume(edge[0], edge[1], face[1], face[2]);
  const double w = volume(edge[0], edge[1], face[2], face[0]);
  return std::min({u, v, w}) > kClear || std::max({u, v, w}) < -kClear;
}

TEST_F(MeshCandidatesTest, EdgesAndFacesThatMeetAreListed) {
  MeshCandidates candidates = fresh();
  int found = 0;
  for (int k = 0; k < 40; ++k) {
    const MotionOrState asked{drawn_state(0.25), k % 2 == 0 ? std::vector<double>() : drawn_state(0.25),
                              k % 4 < 2 ? 0.0 : 0.05};
    candidates.ask_about(asked);
    Pairs pairs;
    candidates.edge_face([&](std::int32_t e, std::int32_t f) {
      EXPECT_TRUE(pairs.insert({e, f}).second);
      for (const std::int32_t v : mesh_.edges[e])
        EXPECT_EQ(std::ranges::count(mesh_.faces[f], v), 0) << "a shared vertex";
    });
    for (int t = 0; t <= 16; ++t) {
      std::vector<double> x = asked.start;
      for (std::size_t i = 0; i < asked.end.size(); ++i) x[i] += t / 16.0 * (asked.end[i] - x[i]);
      for (std::size_t e = 0; e < mesh_.edges.size(); ++e) {
        for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
          if (!pierces(x, mesh_.edges[e], mesh_.faces[f])) continue;
          if (std::ranges::find_first_of(mesh_.edges[e], mesh_.faces[f]) != mesh_.edges[e].end()) continue;
          ++found;
          EXPECT_TRUE(pairs.contains({static_cast<std::int32_t>(e), static_cast<std::int32_t>(f)}))
              << e << ", " << f << " at " << t << "/16";
        }
      }
    }
    // What is asked next is not confused by it.
    EXPECT_GE(expect_right(candidates, asked), 0);
  }
  EXPECT_GT(found, 500);
}

TEST_F(MeshCandidatesTest, OfOnePatchNothingIsListed) {
  mesh_.patches.assign(mesh_.vertex_count, 1);
  for (std::size_t v = mesh_.vertex_count - 8; v < mesh_.vertex_count; ++v)
    mesh_.patches[v] = v % 2 == 0 ? 0 : 2;
  MeshCandidates with = fresh();
  mesh_.patches.clear();
  MeshCandidates without = fresh();
  const std::vector<std::uint32_t> patches = with.mesh().patches;
  const MotionOrState asked{drawn_state(0.3), drawn_state(0.3), 0.1};
  with.ask_about(asked);
  without.ask_about(asked);
  for (const Kind kind : kKinds) {
    Pairs expected = listed(without, kind);
    const std::size_t all = expected.size();
    for_all(kind, [&](std::int32_t a, std::int32_t b, const Corners& corners) {
      const std::uint32_t patch = patches[corners[0]];
      if (patch != 0 && std::ranges::all_of(corners, [&](std::int32_t v) { return patches[v] == patch; }))
        expected.erase({a, b});
    });
    EXPECT_LT(expected.size(), all);
    EXPECT_EQ(listed(with, kind), expected);
  }
}

TEST_F(MeshCandidatesTest, WhatAFailedQuestionWasAboutIsForgotten) {
  MeshCandidates candidates = fresh();
  const MotionOrState right{drawn_state(0.1), drawn_state(0.1), 0.05};
  EXPECT_GT(expect_right(candidates, right), 0);
  MotionOrState wrong = right;
  wrong.end[4] = std::numeric_limits<double>::quiet_NaN();
  candidates.ask_about(wrong);
  EXPECT_THROW(listed(candidates, Kind::kEdgeEdge), std::invalid_argument);
  EXPECT_THROW(listed(candidates, Kind::kEdgeVertex), std::invalid_argument);
  EXPECT_GT(expect_right(candidates, {right.end, {}, 0.05}), 0);
  EXPECT_GT(expect_right(candidates, right), 0);
}

TEST_F(MeshCandidatesTest, MeshesWithoutNumbersOfTheirOwn) {
  const auto create = [](Mesh mesh) { return MeshCandidates::create(std::move(mesh), testing::workers()); };
  EXPECT_FALSE(create({3, {{0, 1}, {1, 0}}, {}, {}})) << "an edge twice";
  EXPECT_FALSE(create({3, {{1, 1}}, {}, {}})) << "an edge that is a point";
  EXPECT_THROW(create({3, {{0, 7}}, {}, {}}), std::invalid_argument);
  // Sides of faces that are not listed as edges are no edges; an empty mesh has no pairs.
  for (Mesh mesh : {Mesh{6, {}, {{0, 1, 2}, {3, 4, 5}}, {}}, Mesh{}}) {
    MeshCandidates candidates = *create(mesh);
    candidates.ask_about({std::vector<double>(3 * mesh.vertex_count, 1.0), {}, 0.5});
    EXPECT_TRUE(listed(candidates, Kind::kEdgeEdge).empty());
    EXPECT_TRUE(listed(candidates, Kind::kEdgeVertex).empty());
    EXPECT_EQ(listed(candidates, Kind::kFaceVertex).size(), mesh.vertex_count);
    EXPECT_EQ(listed(candidates, Kind::kVertexVertex).size(),
              mesh.vertex_count * (mesh.vertex_count - 1) / 2);
  }
}

}  // namespace
}  // namespace warmfront::ipc_toolkit
