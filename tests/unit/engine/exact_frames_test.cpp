// SPDX-License-Identifier: Apache-2.0
// The exact tier on the real steps: symbolic truth pair for pair, and the same bits all ways.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>
#include <tuple>

#include "engine/collider.h"
#include "engine/contact_hash.h"
#include "tests/support/data.h"
#include "tests/support/exact_oracle.h"
#include "tests/support/feature_case.h"
#include "tests/support/real_collider.h"
#include "tests/support/real_scene.h"

namespace warmfront {
namespace {

using testing::real_collider;
using testing::real_contact;
using testing::RealContact;
using testing::RealMesh;
using testing::scene_of;

// A real step, and the pairs that collide in it by symbolic truth.
struct RealStep {
  RealMesh t0;
  RealMesh t1;
  std::shared_ptr<const Scene> scene;
  std::set<RealContact> truth;

  explicit RealStep(const std::filesystem::path& folder)
      : t0(testing::read_mesh(folder / "t0.ply")),
        t1(testing::read_mesh(folder / "t1.ply")),
        scene(scene_of(t0)) {
    std::ifstream in(folder / "truth.csv");
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
      const bool edge_edge = line[0] == 'e';
      std::replace(line.begin(), line.end(), ',', ' ');
      std::istringstream fields(line.substr(3));
      std::array<std::uint32_t, 4> v{};
      int collides = 0;
      fields >> v[0] >> v[1] >> v[2] >> v[3] >> collides;
      if (collides == 1) truth.insert(real_contact(edge_edge, v));
    }
  }

  std::set<RealContact> keys(std::span<const Contact> contacts) const {
    std::set<RealContact> all;
    for (const Contact& contact : contacts)
      all.insert(real_contact(contact.kind == ContactKind::kEdgeEdge, scene->vertices_of(contact)));
    return all;
  }

  // Does the oracle agree?
  bool confirmed(const Contact& contact) const {
    const auto ids = scene->vertices_of(contact);
    std::array<VertexMotion, 4> vertices{};
    for (int k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        vertices[k].t0[axis] = t0.positions[3 * ids[k] + axis];
        vertices[k].t1[axis] = t1.positions[3 * ids[k] + axis];
      }
    return testing::exact_truth(testing::FeatureCase(contact.kind, vertices).features()).contact;
  }
};

class ExactFrames : public ::testing::TestWithParam<const char*> {
 protected:
  static RealStep step() { return RealStep(testing::data_root() / "frames" / GetParam()); }
};

TEST_P(ExactFrames, ReportTheTrueContactsAndHardlyNeedGmp) {
  WARMFRONT_NEED_DATA("frames");
  const RealStep real = step();
  Collider engine = real_collider(real.scene, real.t0.positions, {.tier = Tier::kExact}, 2);
  const auto result = engine.step(std::span<const float>(real.t1.positions));
  ASSERT_TRUE(result.ok());
  const StepResult& answer = result.value();
  EXPECT_TRUE(std::ranges::includes(real.keys(answer.contacts), real.truth));
  std::size_t beyond = 0;  // the file lists what one conservative method flagged
  for (const Contact& contact : answer.contacts) {
    EXPECT_TRUE(contact.status == ContactStatus::kHit || contact.toi == 0);
    if (real.truth.contains(
            real_contact(contact.kind == ContactKind::kEdgeEdge, real.scene->vertices_of(contact))))
      continue;
    ++beyond;
    EXPECT_TRUE(real.confirmed(contact)) << contact.a << " " << contact.b;
  }
  const StepCounts& counts = answer.statistics.counts;
  std::cout << GetParam() << ": " << answer.contacts.size() << " contacts, " << beyond
            << " of them beyond the file; " << counts.exact_tests << " of " << counts.elementary_tests
            << " pairs by GMP\n";
  EXPECT_LT(1000 * counts.exact_tests, counts.elementary_tests);
}

// There and back again, so that fronts are built and updated.
TEST_P(ExactFrames, GiveTheSameBitsAllWays) {
  WARMFRONT_NEED_DATA("frames");
  const RealStep real = step();
  std::string expected;
  for (const auto& [front, bounds, threads] : {std::tuple(FrontMode::kNone, BoundsKind::kKDop18, 1),
                                               std::tuple(FrontMode::kWarm, BoundsKind::kKDop18, 8),
                                               std::tuple(FrontMode::kPaper, BoundsKind::kAabb, 2)}) {
    Collider engine = real_collider(real.scene, real.t0.positions,
                                    {.tier = Tier::kExact, .front = front, .bounds = bounds}, threads);
    ContactHash hash;
    for (const RealMesh* mesh : {&real.t1, &real.t0}) {
      const auto result = engine.step(std::span<const float>(mesh->positions));
      ASSERT_TRUE(result.ok());
      hash.add_step(*real.scene, result.value().contacts);
    }
    if (expected.empty()) expected = hash.hex();
    EXPECT_EQ(hash.hex(), expected) << to_string(front) << " " << threads;
  }
}
INSTANTIATE_TEST_SUITE_P(Data, ExactFrames, ::testing::Values("cloth-ball", "n-body"));

}  // namespace
}  // namespace warmfront
