// SPDX-License-Identifier: Apache-2.0
// The oracle against cases solved by hand, symbolic truth from elsewhere, and the certified tier's proofs.
#include "tests/support/exact_oracle.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "engine/elementary/certified.h"
#include "tests/support/data.h"
#include "tests/support/query_file.h"
#include "tests/support/real_scene.h"

namespace warmfront::testing {
namespace {

using Points = std::array<std::array<double, 3>, 4>;

constexpr ContactKind kVF = ContactKind::kVertexFace;
constexpr ContactKind kEE = ContactKind::kEdgeEdge;

std::array<VertexMotion, 4> motion(const Points& t0, const Points& t1) {
  std::array<VertexMotion, 4> vertices{};
  for (int k = 0; k < 4; ++k) {
    vertices[k].t0 = {t0[k][0], t0[k][1], t0[k][2], 0};
    vertices[k].t1 = {t1[k][0], t1[k][1], t1[k][2], 0};
  }
  return vertices;
}

FeatureVertices features(ContactKind kind, const std::array<VertexMotion, 4>& v) {
  return {kind, {&v[0], &v[1], &v[2], &v[3]}};
}

ExactTruth truth(ContactKind kind, const Points& t0, const Points& t1) {
  return exact_truth(features(kind, motion(t0, t1)));
}

Points with_first(const Points& points, double x, double y, double z) {
  Points result = points;
  result[0] = {x, y, z};
  return result;
}

constexpr Points kAbove{{{0.25, 0.25, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};

void expect_contact(const ExactTruth& t, double toi, bool exact = true) {
  EXPECT_TRUE(t.contact);
  EXPECT_EQ(t.toi, toi);
  EXPECT_EQ(t.toi_exact, exact);
  EXPECT_EQ(t.at_start, toi == 0);
}

TEST(ExactOracle, VertexAndFace) {
  expect_contact(truth(kVF, kAbove, with_first(kAbove, 0.25, 0.25, -1)), 0.5);
  expect_contact(truth(kVF, kAbove, with_first(kAbove, 0.25, 0.25, -2)), 0x1.5555555555555p-2, false);
  expect_contact(truth(kVF, kAbove, with_first(kAbove, 0.25, 0.25, 0)), 1);
  expect_contact(truth(kVF, with_first(kAbove, 0.25, 0.25, 0), kAbove), 0);
  EXPECT_FALSE(truth(kVF, kAbove, with_first(kAbove, 0.25, 0.25, 0x1p-1074)).contact);
  // Onto an edge and onto a corner, and one ulp beside them.
  expect_contact(truth(kVF, with_first(kAbove, 0.5, 0.5, 1), with_first(kAbove, 0.5, 0.5, -1)), 0.5);
  expect_contact(truth(kVF, with_first(kAbove, 1, 0, 1), with_first(kAbove, 1, 0, -1)), 0.5);
  const double beside = 0x1.0000000000001p-1;
  EXPECT_FALSE(truth(kVF, with_first(kAbove, 0.5, beside, 1), with_first(kAbove, 0.5, beside, -1)).contact);
  EXPECT_FALSE(
      truth(kVF, with_first(kAbove, 1, -0x1p-1074, 1), with_first(kAbove, 1, -0x1p-1074, -1)).contact);
}

TEST(ExactOracle, EdgeAndEdge) {
  const Points apart{{{-1, 0, 1}, {1, 0, 1}, {0, -1, 0}, {0, 1, 0}}};
  const Points through{{{-1, 0, -1}, {1, 0, -1}, {0, -1, 0}, {0, 1, 0}}};
  expect_contact(truth(kEE, apart, through), 0.5);
  const Points ends{{{0, 0, 1}, {1, 0, 1}, {0, 0, 0}, {0, 1, 0}}};
  const Points ends_through{{{0, 0, -3}, {1, 0, -3}, {0, 0, 0}, {0, 1, 0}}};
  expect_contact(truth(kEE, ends, ends_through), 0.25);
  Points beside = ends, beside_through = ends_through;
  beside[0][0] = beside_through[0][0] = 0x1p-1074;
  EXPECT_FALSE(truth(kEE, beside, beside_through).contact);
}

TEST(ExactOracle, WithinAPlane) {
  const Points from{{{3, 0.25, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  expect_contact(truth(kVF, from, with_first(from, 0, 0.25, 0)), 0.75);
  EXPECT_FALSE(truth(kVF, from, with_first(from, 1, 0.25, 0)).contact);
  EXPECT_FALSE(truth(kVF, from, with_first(from, -3, 4.25, 0)).contact);
  // Parallel edges, of which one falls onto the other; then along one line.
  const Points apart{{{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {2, 1, 0}}};
  const Points through{{{0, 0, 0}, {1, 0, 0}, {0.5, -1, 0}, {2, -1, 0}}};
  expect_contact(truth(kEE, apart, through), 0.5);
  const Points line{{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}};
  const Points reaching{{{0, 0, 0}, {1, 1, 1}, {0.5, 0.5, 0.5}, {3, 3, 3}}};
  expect_contact(truth(kEE, line, reaching), 0x1.5555555555555p-1, false);
  EXPECT_FALSE(truth(kEE, line, line).contact);
}

TEST(ExactOracle, DegeneratePrimitives) {
  const Points points{{{0, 0, 1}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  expect_contact(truth(kVF, points, with_first(points, 0, 0, -1)), 0.5);
  EXPECT_FALSE(truth(kVF, points, with_first(points, 0x1p-1074, 0, -1)).contact);
  const Points thin{{{1, 0, 1}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}}};
  expect_contact(truth(kVF, thin, with_first(thin, 1, 0, -1)), 0.5);
  EXPECT_FALSE(truth(kVF, with_first(thin, 2.5, 0, 1), with_first(thin, 2.5, 0, -1)).contact);
  const Points edges{{{0, 0, 1}, {0, 0, 1}, {-1, 0, 0}, {1, 0, 0}}};
  const Points down{{{0, 0, -1}, {0, 0, -1}, {-1, 0, 0}, {1, 0, 0}}};
  expect_contact(truth(kEE, edges, down), 0.5);
  const Points same{{{5, 5, 5}, {5, 5, 5}, {5, 5, 5}, {5, 5, 5}}};
  expect_contact(truth(kEE, same, same), 0);
}

TEST(ExactOracle, FirstTimeIsIrrational) {
  // The face's far corner rises as the vertex falls: 1 - 2 t = t (1/4 + t / 4) solved by hand:
  // t^2 + 9 t - 4 = 0, t = (sqrt(97) - 9) / 2.
  const Points t0{{{0.25, 0, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const Points t1{{{0.5, 0, -1}, {0, 0, 0}, {1, 0, 1}, {0, 1, 0}}};
  const ExactTruth t = truth(kVF, t0, t1);
  EXPECT_TRUE(t.contact);
  EXPECT_FALSE(t.toi_exact);
  EXPECT_NEAR(t.toi, 0.42442890089805, 1e-14);
}

TEST(ExactOracle, QuerySets) {
  WARMFRONT_NEED_DATA("queries");
  int queries = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data_root() / "queries")) {
    if (entry.path().extension() != ".csv") continue;
    const auto kind = entry.path().parent_path().filename() == "edge-edge" ? kEE : kVF;
    for (const FileQuery& query : read_queries(entry.path())) {
      ++queries;
      ASSERT_EQ(exact_truth(features(kind, query.vertices)).contact, query.truth) << entry.path() << queries;
    }
  }
  EXPECT_GT(queries, 4000);
}

// One row in ten of the frames' symbolic truth.
class OracleOnFrames : public ::testing::TestWithParam<const char*> {};

TEST_P(OracleOnFrames, AgreesWithSymbolicTruth) {
  WARMFRONT_NEED_DATA("frames");
  const auto folder = data_root() / "frames" / GetParam();
  const RealMesh t0 = read_mesh(folder / "t0.ply");
  const RealMesh t1 = read_mesh(folder / "t1.ply");
  std::ifstream in(folder / "truth.csv");
  std::string line;
  std::getline(in, line);
  int row = 0, contacts = 0;
  while (std::getline(in, line)) {
    if (++row % 10 != 0) continue;
    const ContactKind kind = line[0] == 'e' ? kEE : kVF;
    std::ranges::replace(line, ',', ' ');
    std::istringstream fields(line.substr(3));
    std::array<std::size_t, 4> v{};
    int collides = 0;
    fields >> v[0] >> v[1] >> v[2] >> v[3] >> collides;
    std::array<VertexMotion, 4> vertices{};
    for (int k = 0; k < 4; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        vertices[k].t0[axis] = t0.positions[3 * v[k] + axis];
        vertices[k].t1[axis] = t1.positions[3 * v[k] + axis];
      }
    }
    const ExactTruth found = exact_truth(features(kind, vertices));
    ASSERT_EQ(found.contact, collides == 1) << line;
    contacts += found.contact;
    const Verdict certified = certified_test(features(kind, vertices), {});
    if (found.contact) {
      ASSERT_TRUE(certified.contact) << line;
      ASSERT_LE(certified.toi, found.toi) << line;
    }
  }
  EXPECT_GT(contacts, 4000);
}
INSTANTIATE_TEST_SUITE_P(Data, OracleOnFrames, ::testing::Values("cloth-ball", "n-body"));

// The oracle's time lies where the certified tier's narrow window does.
TEST(ExactOracle, AgreesWithCertifiedOnRandomQueries) {
  std::mt19937_64 random(5);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  int contacts = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    Points t0, t1;
    for (int k = 0; k < 4; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        t0[k][axis] = uniform();
        t1[k][axis] = uniform();
      }
    }
    const auto vertices = motion(t0, t1);
    const auto kind = trial % 2 == 0 ? kVF : kEE;
    const ExactTruth found = exact_truth(features(kind, vertices));
    const Verdict certified = certified_test(features(kind, vertices), {.tolerance = 1e-10});
    ASSERT_EQ(found.contact, certified.contact) << trial;
    if (!found.contact) continue;
    ++contacts;
    ASSERT_LE(certified.toi, found.toi) << trial;
    ASSERT_NEAR(certified.toi, found.toi, 1e-6) << trial;
  }
  EXPECT_GT(contacts, 400);
}

}  // namespace
}  // namespace warmfront::testing
