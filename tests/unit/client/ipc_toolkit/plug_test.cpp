// SPDX-License-Identifier: Apache-2.0
// The plug for IPC Toolkit, through that library's own interface: with it where it is found, else with its
// stand-in. The candidates themselves are tested in mesh_candidates_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "client/ipc_toolkit/broad_phase.h"
#include "client/ipc_toolkit/narrow_phase_ccd.h"
#include "tests/support/scenes.h"

namespace warmfront::ipc_toolkit {
namespace {

using Pairs = std::set<std::pair<int, int>>;
using Vertices = Eigen::MatrixXd;
using Elements = Eigen::MatrixXi;

template <class Candidate, class First, class Second>
Pairs pairs_of(const std::vector<Candidate>& candidates, First first, Second second) {
  // Methods list two of one kind in either order.
  constexpr bool kOfOneKind = std::is_same_v<Candidate, ::ipc::VertexVertexCandidate> ||
                              std::is_same_v<Candidate, ::ipc::EdgeEdgeCandidate> ||
                              std::is_same_v<Candidate, ::ipc::FaceFaceCandidate>;
  Pairs pairs;
  for (const Candidate& c : candidates) {
    std::pair<int, int> pair(c.*first, c.*second);
    if (kOfOneKind && pair.first > pair.second) std::swap(pair.first, pair.second);
    EXPECT_TRUE(pairs.insert(pair).second) << "listed twice";
  }
  return pairs;
}

/// By kind: vertex-vertex, edge-vertex, edge-edge, face-vertex, edge-face, face-face.
std::array<Pairs, 6> detect(const ::ipc::BroadPhase& method) {
  std::vector<::ipc::VertexVertexCandidate> vv;
  std::vector<::ipc::EdgeVertexCandidate> ev;
  std::vector<::ipc::EdgeEdgeCandidate> ee;
  std::vector<::ipc::FaceVertexCandidate> fv;
  std::vector<::ipc::EdgeFaceCandidate> ef;
  std::vector<::ipc::FaceFaceCandidate> ff;
  method.detect_vertex_vertex_candidates(vv);
  method.detect_edge_vertex_candidates(ev);
  method.detect_edge_edge_candidates(ee);
  method.detect_face_vertex_candidates(fv);
  method.detect_edge_face_candidates(ef);
  method.detect_face_face_candidates(ff);
  return {pairs_of(vv, &::ipc::VertexVertexCandidate::vertex0_id, &::ipc::VertexVertexCandidate::vertex1_id),
          pairs_of(ev, &::ipc::EdgeVertexCandidate::edge_id, &::ipc::EdgeVertexCandidate::vertex_id),
          pairs_of(ee, &::ipc::EdgeEdgeCandidate::edge0_id, &::ipc::EdgeEdgeCandidate::edge1_id),
          pairs_of(fv, &::ipc::FaceVertexCandidate::face_id, &::ipc::FaceVertexCandidate::vertex_id),
          pairs_of(ef, &::ipc::EdgeFaceCandidate::edge_id, &::ipc::EdgeFaceCandidate::face_id),
          pairs_of(ff, &::ipc::FaceFaceCandidate::face0_id, &::ipc::FaceFaceCandidate::face1_id)};
}

/// A sheet of small triangles and a point.
struct Sheet {
  explicit Sheet(int side) : side_count(side), vertices((side + 1) * (side + 1) + 1, 3) {
    const auto triangles = testing::grid(side);
    faces.resize(static_cast<Eigen::Index>(triangles.size()), 3);
    std::set<std::pair<int, int>> sides;
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      for (int k = 0; k < 3; ++k)
        faces(f, k) = triangles[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)];
      for (int k = 0; k < 3; ++k) sides.insert(std::minmax(faces(f, k), faces(f, (k + 1) % 3)));
    }
    edges.resize(static_cast<Eigen::Index>(sides.size()), 2);
    Eigen::Index e = 0;
    for (const auto& [a, b] : sides) edges.row(e++) << b, a;
  }
  Vertices drawn() {
    Vertices x = vertices;
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      x.row(i) << 0.3 * static_cast<double>(i / (side_count + 1)),
          0.3 * static_cast<double>(i % (side_count + 1)), 0;
    x.row(x.rows() - 1) << 0.4, 0.4, 0.02;
    return x + 0.25 * x.unaryExpr([this](double) { return by(random); });
  }

  int side_count;
  Vertices vertices;
  Elements edges, faces;
  std::mt19937_64 random{1};
  std::uniform_real_distribution<double> by{-1, 1};
};

void build(::ipc::BroadPhase& method, const Sheet& sheet, const Vertices& x, const Vertices* y,
           double radius) {
  if (y != nullptr) {
    method.build(x, *y, sheet.edges, sheet.faces, radius);
  } else {
    method.build(x, sheet.edges, sheet.faces, radius);
  }
}

bool within(const Pairs& some, const Pairs& all) {
  return std::ranges::includes(all, some);
}

TEST(IpcToolkitPlug, ListsFewerPairsThanBoxesAndOfEachMeshItsOwn) {
  BroadPhase ours(2);
  EXPECT_EQ(ours.name(), "Warmfront");
  const auto theirs = ::ipc::make_default_broad_phase();
  std::vector<Sheet> sheets{Sheet(3), Sheet(4), Sheet(5),
                            Sheet(6), Sheet(2), Sheet(1)};  // more than are kept
  std::array<std::size_t, 6> listed{};
  for (int k = 0; k < 48; ++k) {
    Sheet& sheet = sheets[static_cast<std::size_t>(k * k) % sheets.size()];
    const Vertices x = sheet.drawn();
    const Vertices y = sheet.drawn();
    const ::ipc::CollisionFilter filter = [k](std::size_t a, std::size_t b) {
      return k % 3 != 0 || (a + b) % 3 != 0;
    };
    ours.can_vertices_collide = theirs->can_vertices_collide = filter;
    build(ours, sheet, x, k % 2 == 0 ? &y : nullptr, 0.01 * (k % 4));
    build(*theirs, sheet, x, k % 2 == 0 ? &y : nullptr, 0.01 * (k % 4));
    const std::array<Pairs, 6> some = detect(ours);
    const std::array<Pairs, 6> all = detect(*theirs);
    for (std::size_t kind = 0; kind < 6; ++kind) {
      EXPECT_TRUE(within(some[kind], all[kind])) << "kind " << kind << ", build " << k;
      listed[kind] += some[kind].size();
    }
    EXPECT_EQ(some[5], all[5]) << "face-face is theirs";
    EXPECT_EQ(some, detect(ours)) << "asked twice";
    BroadPhase cold(1);
    cold.can_vertices_collide = filter;
    build(cold, sheet, x, k % 2 == 0 ? &y : nullptr, 0.01 * (k % 4));
    EXPECT_EQ(some, detect(cold)) << "warm or cold, on two threads or one";
  }
  for (const std::size_t count : listed) EXPECT_GT(count, 5U);
}

TEST(IpcToolkitPlug, AnswersTheirWayWhatItHasNoSceneFor) {
  BroadPhase ours(1);
  const auto theirs = ::ipc::make_default_broad_phase();
  Sheet sheet(3);
  const Vertices x = sheet.drawn();
  sheet.edges.row(0) = sheet.edges.row(1);  // an edge twice
  build(ours, sheet, x, nullptr, 0.05);
  build(*theirs, sheet, x, nullptr, 0.05);
  EXPECT_EQ(detect(ours), detect(*theirs));

  ::ipc::AABBs boxes(20);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    boxes[i].min = Eigen::Array3d(0.6 * static_cast<double>(i), 0, 0);
    boxes[i].max = boxes[i].min + Eigen::Array3d(1, 0, 0);
    boxes[i].vertex_ids = {static_cast<::ipc::index_t>(i), -1, -1};
  }
  ours.build(boxes, Elements(), Elements(), 3);
  EXPECT_EQ(detect(ours)[0].size(), boxes.size() - 1);
}

TEST(IpcToolkitPlug, PatchesAreLeftOut) {
  Sheet sheet(4);
  const auto n = static_cast<std::size_t>(sheet.vertices.rows());
  std::vector<std::uint32_t> patches(n);
  for (std::size_t v = 0; v < n; ++v) patches[v] = 1 + static_cast<std::uint32_t>(v % 5 < 3);
  BroadPhase by_search(1, patches);
  BroadPhase by_filter(1);
  by_filter.can_vertices_collide = [&](std::size_t a, std::size_t b) { return patches[a] != patches[b]; };
  const Vertices x = sheet.drawn();
  build(by_search, sheet, x, nullptr, 0.05);
  build(by_filter, sheet, x, nullptr, 0.05);
  const auto some = detect(by_search);
  const auto filtered = detect(by_filter);
  for (std::size_t kind = 0; kind < 4; ++kind) EXPECT_EQ(some[kind], filtered[kind]) << "kind " << kind;
  EXPECT_TRUE(within(filtered[4], some[4]));
  EXPECT_FALSE(some[2].empty());
}

TEST(IpcToolkitPlug, PatchesOfAnotherMeshAreRefused) {
  const Sheet sheet(4), larger(5);
  const auto n = static_cast<std::size_t>(sheet.vertices.rows());
  BroadPhase ours(1, std::vector<std::uint32_t>(n, 0));
  build(ours, sheet, sheet.vertices, nullptr, 0.05);
  const std::string words = "warmfront: patches: " + std::to_string(n) + " numbers for a mesh of " +
                            std::to_string(larger.vertices.rows()) + " vertices; give one for each, or none";
  EXPECT_THAT([&] { build(ours, larger, larger.vertices, nullptr, 0.05); },
              ::testing::ThrowsMessage<std::invalid_argument>(words));
}

TEST(IpcToolkitPlug, InThePlane) {
  BroadPhase ours(1);
  const auto theirs = ::ipc::make_default_broad_phase();
  Sheet sheet(4);
  for (int k = 0; k < 4; ++k) {
    const Vertices x = sheet.drawn().leftCols(2);
    const Vertices y = sheet.drawn().leftCols(2);
    for (::ipc::BroadPhase* method : {static_cast<::ipc::BroadPhase*>(&ours), theirs.get()})
      build(*method, sheet, x, k % 2 == 0 ? &y : nullptr, 0);
    const auto some = detect(ours);
    const auto all = detect(*theirs);
    EXPECT_FALSE(some[1].empty());
    EXPECT_TRUE(within(some[1], all[1]));
    EXPECT_TRUE(within(some[2], all[2]));
  }
}

TEST(IpcToolkitPlug, SeveralThreadsAskForCandidates) {
  BroadPhase ours(2);
  Sheet sheet(6);
  build(ours, sheet, sheet.drawn(), nullptr, 0.05);
  const auto expected = detect(ours);
  build(ours, sheet, sheet.drawn(), nullptr, 0);
  ours.clear();
  std::vector<::ipc::EdgeEdgeCandidate> none;
  Sheet again(6);
  build(ours, again, again.drawn(), nullptr, 0.05);
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) threads.emplace_back([&] { EXPECT_EQ(detect(ours), expected); });
  for (std::thread& thread : threads) thread.join();
}

TEST(IpcToolkitPlug, RefusesWhatIsNotFinite) {
  BroadPhase ours(1);
  Sheet sheet(2);
  Vertices x = sheet.drawn();
  x(1, 1) = std::numeric_limits<double>::infinity();
  build(ours, sheet, x, nullptr, 0);
  std::vector<::ipc::EdgeEdgeCandidate> candidates;
  EXPECT_THROW(ours.detect_edge_edge_candidates(candidates), std::invalid_argument);
  build(ours, sheet, sheet.drawn(), nullptr, 0.1);
  ours.detect_edge_edge_candidates(candidates);
  EXPECT_FALSE(candidates.empty());
}

/// A vertex that falls from `height` above a unit triangle to as far below it.
bool fall(const ::ipc::NarrowPhaseCCD& ccd, double height, double& toi, double min_distance = 0,
          double tmax = 1) {
  const Eigen::Vector3d above(0.25, 0.25, height), below(0.25, 0.25, -height), a(0, 0, 0), b(1, 0, 0),
      c(0, 1, 0);
  return ccd.point_triangle_ccd(above, a, b, c, below, a, b, c, toi, min_distance, tmax);
}

TEST(IpcToolkitPlug, TimesAreEarlyByTheShareThatIsKept) {
  for (const double share : {0.8, 0.9, 0.99}) {
    const NarrowPhaseCCD ccd(1e-6, share);
    for (double height = 1; height > 1e-12; height /= 10) {
      double toi = -1;
      ASSERT_TRUE(fall(ccd, height, toi)) << height;
      EXPECT_GT(toi, 0) << height;
      EXPECT_LE(toi, 0.5 * share * (1 + 1e-9)) << height;
      EXPECT_GE(toi, 0.5 * share * (1 - 0x1p-5)) << height;
    }
  }
  // Without a share to keep, too, no pair is held up because it is near.
  for (double height = 1e-3; height > 1e-12; height /= 10) {
    double toi = -1;
    ASSERT_TRUE(fall(NarrowPhaseCCD(1e-6, 1), height, toi)) << height;
    EXPECT_GT(toi, 0) << height;
    EXPECT_LE(toi, 0.5) << height;
  }
  double toi = -1;
  ASSERT_TRUE(fall(NarrowPhaseCCD(1e-6, 1), 1, toi));
  EXPECT_NEAR(toi, 0.5, 1e-5);
  EXPECT_LE(toi, 0.5);
  ASSERT_TRUE(fall(NarrowPhaseCCD(), 1, toi, 0.5));
  EXPECT_LE(toi, 0.2);
  EXPECT_GE(toi, 0.2 * (1 - 0x1p-6));
  EXPECT_FALSE(fall(NarrowPhaseCCD(), 1, toi, 0, 0.3)) << "later than asked";
  ASSERT_TRUE(fall(NarrowPhaseCCD(), 1, toi, 1)) << "starts within the minimum distance";
  EXPECT_EQ(toi, 0);
}

// A vertex as near above a triangle as roundings are, that goes through it: where no test in doubles proves
// the two apart, the exact one does.
TEST(IpcToolkitPlug, NothingStopsAtOnceThatDoesNotTouch) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> by(-1, 1);
  const auto drawn = [&] { return Eigen::Vector3d(by(random), by(random), by(random)); };
  const NarrowPhaseCCD ccd;
  int apart = 0;
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector3d a = drawn(), b = drawn(), c = drawn();
    const Eigen::Vector3d up = (b - a).cross(c - a).normalized();
    const Eigen::Vector3d above = (a + b + c) / 3 + std::ldexp(1.0, -40 - k % 14) * up;
    const Eigen::Vector3d below = above - up;
    MovingPair pair{ContactKind::kVertexFace, {}, {}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      for (const auto& [v, x] : {std::pair(1, a), std::pair(2, b), std::pair(3, c)})
        pair.start[static_cast<std::size_t>(v)][axis] = pair.end[static_cast<std::size_t>(v)][axis] = x[i];
      pair.start[0][axis] = above[i];
      pair.end[0][axis] = below[i];
    }
    const auto first = test_pair(pair, {.tier = Tier::kExact}).value();
    double toi = -1;
    const bool stops = ccd.point_triangle_ccd(above, a, b, c, below, a, b, c, toi);
    EXPECT_TRUE(stops || !first);
    if (!first || first->toi == 0) continue;
    ++apart;
    EXPECT_GT(toi, 0) << k;
    EXPECT_LE(toi, first->toi) << k;
  }
  EXPECT_GT(apart, 1000);
}

TEST(IpcToolkitPlug, NoPairKeepsMoreThanTheLengthGiven) {
  NarrowPhaseCCD ccd;
  ccd.most_kept = 0.01;
  double toi = -1;
  ASSERT_TRUE(fall(ccd, 1, toi));
  EXPECT_LE(toi, 0.495);
  EXPECT_GE(toi, 0.494);
  ASSERT_TRUE(fall(ccd, 1, toi, 0.5));
  EXPECT_LE(toi, 0.245);
  EXPECT_GE(toi, 0.244);
  ASSERT_TRUE(fall(ccd, 0.001, toi)) << "its own share is less";
  EXPECT_LE(toi, 0.4);
  EXPECT_GE(toi, 0.4 * (1 - 0x1p-5));
  const Eigen::Vector3d from(0.25, 0.25, 1), to(0.25, 0.25, 0.1), a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  EXPECT_FALSE(ccd.point_triangle_ccd(from, a, b, c, to, a, b, c, toi)) << "a tenth of the way is kept";
  EXPECT_TRUE(NarrowPhaseCCD().point_triangle_ccd(from, a, b, c, to, a, b, c, toi));
}

TEST(IpcToolkitPlug, PointsAndEdgesInBothDimensions) {
  const NarrowPhaseCCD ccd;
  for (const int dimension : {2, 3}) {
    const auto at = [&](double x, double y) {
      ::ipc::VectorMax3d p = ::ipc::VectorMax3d::Zero(dimension);
      p.head(2) << x, y;
      return p;
    };
    double toi = -1;
    EXPECT_TRUE(ccd.point_point_ccd(at(0, 0), at(1, 0), at(1, 0), at(0, 0), toi));
    EXPECT_NEAR(toi, 0.4, 0.4 * 0x1p-6);
    EXPECT_FALSE(ccd.point_point_ccd(at(0, 0), at(1, 0), at(0, 1), at(1, 1), toi));
    EXPECT_TRUE(ccd.point_edge_ccd(at(0, 1), at(-1, 0), at(1, 0), at(0, -1), at(-1, 0), at(1, 0), toi));
    EXPECT_NEAR(toi, 0.4, 0.4 * 0x1p-6);
    EXPECT_FALSE(ccd.point_edge_ccd(at(2, 1), at(-1, 0), at(1, 0), at(2, -1), at(-1, 0), at(1, 0), toi));
  }
  double toi = -1;
  const Eigen::Vector3d a(-1, 0, 0), b(1, 0, 0), c(0, -1, 1), d(0, 1, 1), down(0, 0, -2);
  EXPECT_TRUE(ccd.edge_edge_ccd(a, b, c, d, a, b, c + down, d + down, toi));
  EXPECT_NEAR(toi, 0.4, 0.4 * 0x1p-6);
  const Eigen::Vector3d nowhere(0, std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_THROW(ccd.edge_edge_ccd(a, b, c, d, a, b, nowhere, d, toi), std::invalid_argument);
}

}  // namespace
}  // namespace warmfront::ipc_toolkit
