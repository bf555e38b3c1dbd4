// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "engine/bounds/kdop.h"
#include "engine/bounds/moving.h"
#include "engine/bounds/normal_cone.h"
#include "engine/bounds/overlap.h"
#include "engine/elementary/query.h"
#include "engine/scene/patches.h"
#include "tests/support/brute_force.h"
#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using testing::least_magnitude;
using testing::motion_between;

KDop18 bounds_of(std::span<const VertexMotion> vertices, std::initializer_list<int> which,
                 const LocalTransform& frame, double separation) {
  KDop18 bounds = KDop18::empty();
  for (const int v : which)
    bounds.merge(moving_bounds(vertices[v], frame, separation, least_magnitude(vertices, frame, separation)));
  return bounds;
}

PointBounds point_of(std::span<const VertexMotion> vertices, int v, const LocalTransform& frame) {
  return point_bounds(vertices[v], frame, least_magnitude(vertices, frame, 0));
}

// "No answer depends on the hierarchy" requires this: pairs that float bounds, in any frame, call disjoint
// are also separated by the cascade's own test of the nine axes. Vertices are placed within ulps of touching
// bounds to provoke a failure.
TEST(MovingBounds, RejectNothingThatTheCascadeWouldNot) {
  std::mt19937_64 random(3);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  int rejected = 0;
  int points_rejected = 0;
  for (int trial = 0; trial < 40000; ++trial) {
    const double offset = trial % 4 == 0 ? std::ldexp(1.0, static_cast<int>(random() % 40)) : 0.0;
    std::vector<double> x0(12);
    std::vector<double> x1(12);
    for (double& x : x0) x = offset + uniform();
    for (std::size_t i = 0; i < 12; ++i) x1[i] = trial % 3 == 0 ? x0[i] : x0[i] + 0.3 * uniform();
    // Push the second edge just beyond the first along x, by a few ulps of the coordinates.
    const double top = std::max({x0[0], x0[3], x1[0], x1[3]});
    const double low = std::min({x0[6], x0[9], x1[6], x1[9]});
    const double gap = std::ldexp(std::fabs(top) + 1, -static_cast<int>(20 + random() % 34));
    const double separation = trial % 5 == 0 ? 0.01 : 0.0;
    for (const int v : {2, 3}) {
      x0[3 * v] += top - low + gap + separation;
      x1[3 * v] += top - low + gap + separation;
    }
    const auto vertices = motion_between(x0, x1);
    // A frame from another time of the scene's life: bigger, and off to the side.
    std::vector<double> other = x0;
    other[0] += 3 * uniform();
    other[4] -= 20;
    const Motion motion(trial % 2 == 0 ? x0 : other);
    const bool apart = !overlap(bounds_of(vertices, {0, 1}, motion.frame(), separation),
                                bounds_of(vertices, {2, 3}, motion.frame(), separation));
    PointBounds points[4];
    for (int v = 0; v < 4; ++v) points[v] = point_of(vertices, v, motion.frame());
    const Width width = Width::of(motion.frame().to_local(separation));
    const bool points_apart = !overlap<KDop18>({{&points[0], &points[1], &points[1]}},
                                               {{&points[2], &points[3], &points[3]}}, width);
    // Points' bounds are the wider ones, by little.
    ASSERT_TRUE(apart || !points_apart) << "trial " << trial;
    if (!apart) continue;
    ++rejected;
    points_rejected += points_apart;
    const Query query = Query::prepare(
        {ContactKind::kEdgeEdge, {&vertices[0], &vertices[1], &vertices[2], &vertices[3]}}, separation);
    Window window;
    ASSERT_FALSE(trim_by_kdop(query, window))
        << "trial " << trial << " left [" << window.begin << ", " << window.end << "]";
  }
  EXPECT_GT(rejected, 10000);
  EXPECT_GT(points_rejected, 5000);
}

// Bounds computed from points in lanes equal those computed from the points' bounds.
TEST(PointBounds, FeaturesOverlapAsTheirBoundsDo) {
  std::mt19937_64 random(12);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  int met = 0;
  int far = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    std::vector<double> x0(18);
    std::vector<double> x1(18);
    for (double& x : x0) x = uniform();
    for (std::size_t i = 0; i < 18; ++i) x1[i] = x0[i] + 0.3 * uniform();
    for (std::size_t i = 9; i < 18; i += 3) x0[i] += 1.2, x1[i] += 1.2;
    const Motion motion(x0);
    if (trial % 50 == 0) x1[random() % 18] = 1e35, ++far;
    const auto vertices = motion_between(x0, x1);
    const double separation = trial % 3 == 0 ? 0.05 : 0.0;
    PointBounds points[6];
    for (int v = 0; v < 6; ++v) points[v] = point_of(vertices, v, motion.frame());
    const Width width = Width::of(motion.frame().to_local(separation));
    const TriangleBounds f{{&points[0], &points[1], &points[2]}};
    const TriangleBounds g{{&points[3], &points[4], &points[5]}};
    const auto merged = [&](std::initializer_list<int> which) {
      KDop18 bounds = KDop18::empty();
      for (const int v : which) bounds.merge(bounds_of(points[v]));
      return bounds;
    };
    const bool overlapping = overlap(merged({0, 1, 2}), merged({3, 4, 5}), width);
    met += overlapping;
    ASSERT_EQ(overlap<KDop18>(f, g, width), overlapping) << trial;
    ASSERT_EQ(overlap<Aabb>(f, g, width),
              overlap(narrow<Aabb>(merged({0, 1, 2})), narrow<Aabb>(merged({3, 4, 5})), width))
        << trial;
    const std::uint32_t features = overlapping_features(f, g, 0x7fff, width);
    const auto expect = [&](int bit, const KDop18& a, const KDop18& b) {
      ASSERT_EQ((features >> bit) & 1U, overlap(a, b, width) ? 1U : 0U) << trial << " bit " << bit;
    };
    for (int i = 0; i < 3; ++i) {
      expect(i, merged({i}), merged({3, 4, 5}));
      expect(3 + i, merged({3 + i}), merged({0, 1, 2}));
      for (int j = 0; j < 3; ++j)
        expect(6 + 3 * i + j, merged({i, (i + 1) % 3}), merged({3 + j, 3 + (j + 1) % 3}));
    }
  }
  EXPECT_GT(met, 200);
  EXPECT_LT(met, 4800);
  EXPECT_GT(far, 50);
}

// Two vertices with common motion stay apart, however far they move: their swept volumes would overlap.
TEST(MovingBounds, CommonMotionDoesNotMatter) {
  const std::vector<double> x0{0, 0, 0, 1, 0, 0};
  const std::vector<double> x1{8, 4, 2, 9, 4, 2};
  const auto vertices = motion_between(x0, x1);
  const Motion motion(x0);
  EXPECT_FALSE(
      overlap(bounds_of(vertices, {0}, motion.frame(), 0), bounds_of(vertices, {1}, motion.frame(), 0)));
  // Passing each other on the way is a meeting, though they are apart at either end.
  const auto crossing = motion_between(x0, std::vector<double>{1, 0, 0, 0, 0, 0});
  EXPECT_TRUE(
      overlap(bounds_of(crossing, {0}, motion.frame(), 0), bounds_of(crossing, {1}, motion.frame(), 0)));
}

TEST(MovingBounds, HoldTheMotionAtAnyScaleAndOffset) {
  std::mt19937_64 random(4);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  for (const int scale : {-1060, -300, 0, 300, 980}) {
    for (const double offset : {0.0, 1e3, 1e12}) {
      std::vector<double> x0(9);
      std::vector<double> x1(9);
      for (double& x : x0) x = std::ldexp(uniform() + offset, scale);
      for (double& x : x1) x = std::ldexp(uniform() + offset, scale);
      const Motion motion(x0);
      const auto vertices = motion_between(x0, x1);
      for (int v = 0; v < 3; ++v) {
        const KDop18 bounds =
            moving_bounds(vertices[v], motion.frame(), 0, least_magnitude(vertices, motion.frame(), 0));
        // Beyond a point's range, its bounds are unbounded.
        const KDop18 of_point = bounds_of(point_of(vertices, v, motion.frame()));
        for (const float lane : of_point.lane) ASSERT_FALSE(std::isnan(lane) || lane > 1e38F);
        for (std::size_t k = 0; k < 3; ++k) {
          for (const std::size_t end : {std::size_t{0}, std::size_t{KDop18::kEnd}}) {
            const auto& at = end == 0 ? vertices[v].t0 : vertices[v].t1;
            const long double local = (static_cast<long double>(at[k]) - motion.frame().origin[k]) *
                                      motion.frame().scale_a * motion.frame().scale_b;
            EXPECT_LE(of_point.lane[end + k], local);
            EXPECT_LE(of_point.lane[end + KDop18::kAxes + k], -local);
          }
        }
        for (int axis = 0; axis < 3; ++axis) {
          for (const double x : {x0[3 * v + axis], x1[3 * v + axis]}) {
            const long double local = (static_cast<long double>(x) - motion.frame().origin[axis]) *
                                      motion.frame().scale_a * motion.frame().scale_b;
            EXPECT_LE(bounds.lower(axis), local);
            EXPECT_GE(bounds.upper(axis), local);
            EXPECT_LT(std::fabs(bounds.lower(axis)), 1e6F);
          }
        }
      }
    }
  }
}

TEST(Refit, NodesHoldTheirPrimitives) {
  std::mt19937_64 random(9);
  for (int trial = 0; trial < 20; ++trial) {
    const auto [scene, positions] = testing::random_scene(random);
    testing::Hierarchy<KDop18> hierarchy(scene, positions, 2);
    hierarchy.step(testing::random_motion(random, *scene, positions));
    const auto& bvh = hierarchy.bvh;
    for (NodeId leaf = bvh.shape.first_leaf(); leaf < bvh.shape.end_node(); ++leaf) {
      for (std::uint32_t i = bvh.shape.begin(leaf); i < bvh.shape.end(leaf); ++i) {
        for (const std::uint32_t v : primitive_vertices(*scene, bvh.order[i])) {
          for (NodeId node = leaf;; node = TreeShape::parent(node)) {
            for (std::size_t lane = 0; lane < bvh.nodes[number_of(node)].lane.size(); ++lane) {
              ASSERT_LE(bvh.nodes[number_of(node)].lane[lane],
                        bounds_of(hierarchy.vertex_bounds()[v]).lane[lane]);
            }
            if (node == kRoot) break;
          }
        }
      }
    }
  }
}

// A strip of `n` quads along a path: vertices come in pairs (inner, outer).
struct Strip {
  testing::Faces faces;
  std::vector<double> positions;
};

template <class Path>
Strip strip(int n, Path path) {
  Strip made;
  for (int i = 0; i <= n; ++i) {
    for (const double side : {0.0, 1.0}) {
      for (const double x : path(static_cast<double>(i) / n, side)) made.positions.push_back(x);
    }
  }
  for (int i = 0; i < n; ++i) {
    const int a = 2 * i;
    made.faces.push_back({a, a + 1, a + 3});
    made.faces.push_back({a, a + 3, a + 2});
  }
  return made;
}

// All faces of a strip as one patch, and its contour.
struct WholePatch {
  std::shared_ptr<const Scene> scene;
  Patches patches;
};

WholePatch whole(const Strip& strip) {
  const auto scene = testing::make_scene(static_cast<std::uint32_t>(strip.positions.size() / 3), strip.faces);
  return {scene, find_patches(*scene, 1000)};
}

bool cone_holds(const Strip& strip) {  // the normals alone, which is what a cone-only test would ask
  const auto vertices = motion_between(strip.positions, strip.positions);
  for (const auto& f : strip.faces) {
    const auto x = [&](int k, int axis) { return vertices[f[k]].t0[axis]; };
    const double nz = (x(1, 0) - x(0, 0)) * (x(2, 1) - x(0, 1)) - (x(1, 1) - x(0, 1)) * (x(2, 0) - x(0, 0));
    if (!(nz > 0)) return false;
  }
  return true;
}

bool embedded(const WholePatch& patch, const std::vector<double>& x0, const std::vector<double>& x1) {
  EXPECT_EQ(patch.patches.count(), 1U);
  return provably_embedded(*patch.scene, motion_between(x0, x1), patch.patches.faces[0],
                           patch.patches.contours[0]);
}

TEST(NormalCone, FlatPatchesAreCulled) {
  const auto scene = testing::make_scene(36, testing::grid(5));
  const Patches patches = find_patches(*scene, 10);
  ASSERT_EQ(patches.count(), 1U);
  EXPECT_EQ(patches.faces[0].size(), 50U);
  EXPECT_EQ(patches.contours[0].size(), 20U);
  std::vector<double> x0(108);
  std::vector<double> x1(108);
  for (int i = 0; i < 36; ++i) {
    x0[3 * i] = x1[3 * i] = i / 6;
    x0[3 * i + 1] = x1[3 * i + 1] = i % 6;
    x0[3 * i + 2] = 0.1 * (i % 3);
    x1[3 * i + 2] = 5 + 0.2 * (i % 5);
  }
  const auto check = [&](const std::vector<double>& a, const std::vector<double>& b) {
    return provably_embedded(*scene, motion_between(a, b), patches.faces[0], patches.contours[0]);
  };
  EXPECT_TRUE(check(x0, x1));
  // Turned over on the way: some normal passes through zero.
  std::vector<double> turned = x1;
  for (int i = 0; i < 36; ++i) turned[3 * i] = -turned[3 * i];
  EXPECT_FALSE(check(x0, turned));
  // One vertex pulled across its neighbour.
  std::vector<double> folded = x1;
  folded[3 * 14] += 2.5;
  EXPECT_FALSE(check(x0, folded));
  EXPECT_FALSE(check(std::vector<double>(108, 0.0), std::vector<double>(108, 0.0)));
}

// A parking-garage ramp: every normal points up, yet its turns lie over each other and can meet.
TEST(NormalCone, RampIsNotCulledByItsContour) {
  const Strip ramp = strip(40, [](double s, double side) {
    const double angle = 4 * 3.14159265358979 * s;  // two turns
    return std::array{(1 + side) * std::cos(angle), (1 + side) * std::sin(angle), 0.3 * s};
  });
  ASSERT_TRUE(cone_holds(ramp));
  EXPECT_FALSE(embedded(whole(ramp), ramp.positions, ramp.positions));
}

// A flat C: its ends can come to overlap within the plane, all normals up at all times.
TEST(NormalCone, CStripIsNotCulledByItsContour) {
  const auto bent = [](double turns) {
    return strip(40, [turns](double s, double side) {
      const double angle = 2 * 3.14159265358979 * turns * s;
      return std::array{(1 + side) * std::cos(angle), (1 + side) * std::sin(angle), 0.0};
    });
  };
  const Strip open = bent(0.9);
  const Strip closed = bent(1.1);
  ASSERT_TRUE(cone_holds(open) && cone_holds(closed));
  EXPECT_FALSE(embedded(whole(open), open.positions, closed.positions));
  // A bend that is star-shaped about its centre is culled: the test does not refuse everything.
  const Strip slight = bent(0.1);
  EXPECT_TRUE(embedded(whole(slight), slight.positions, slight.positions));
}

TEST(Patches, AreManifoldOrientedDisks) {
  // A tetrahedron is closed: no contour. Two flipped neighbours: not oriented alike.
  EXPECT_EQ(find_patches(*testing::make_scene(4, testing::tetrahedron()), 100).count(), 0U);
  auto faces = testing::grid(4);
  std::swap(faces[7][0], faces[7][1]);
  const auto scene = testing::make_scene(25, faces);
  const Patches patches = find_patches(*scene, 1000);
  EXPECT_EQ(patches.of_face[7], Patches::kNone);
  const Patches small = find_patches(*testing::make_scene(21 * 21, testing::grid(20)), 3);
  EXPECT_GT(small.count(), 10U);
  for (std::size_t p = 0; p < small.count(); ++p) EXPECT_LE(small.faces[p].size(), 54U);
  EXPECT_LT(std::ranges::count(small.of_face, Patches::kNone), 200) << "of 800 faces";
}

}  // namespace
}  // namespace warmfront
