// SPDX-License-Identifier: Apache-2.0
// The engine on the real scenes: symbolic truth for single steps, equal answers of all ways over sequences.
#include "tests/support/data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>

#include "engine/collider.h"
#include "engine/contact_hash.h"
#include "engine/front/front.h"
#include "tests/support/hierarchy.h"
#include "tests/support/real_collider.h"
#include "tests/support/real_scene.h"

namespace warmfront {
namespace {

using testing::FrameSequence;
using testing::real_collider;
using testing::real_contact;
using testing::RealContact;
using testing::RealMesh;
using testing::scene_of;

class Frames : public ::testing::TestWithParam<const char*> {};

TEST_P(Frames, NoTrueContactIsMissingAndAtMostOnePercentIsExtra) {
  WARMFRONT_NEED_DATA("frames");
  const auto folder = testing::data_root() / "frames" / GetParam();
  const RealMesh t0 = testing::read_mesh(folder / "t0.ply");
  const RealMesh t1 = testing::read_mesh(folder / "t1.ply");
  const auto scene = scene_of(t0);
  Collider engine = real_collider(scene, t0.positions, {}, 2);
  const auto result = engine.step(std::span<const float>(t1.positions));
  ASSERT_TRUE(result.ok());
  std::set<RealContact> reported;
  for (const Contact& contact : result.value().contacts) {
    reported.insert(real_contact(contact.kind == ContactKind::kEdgeEdge, scene->vertices_of(contact)));
  }
  std::size_t truth = 0;
  std::size_t missing = 0;
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
    truth += collides == 1;
    missing += collides == 1 && !reported.contains(real_contact(edge_edge, v));
  }
  std::cout << GetParam() << ": " << truth << " true contacts, " << missing << " missing, " << reported.size()
            << " reported\n";
  EXPECT_GT(truth, 50000U);
  EXPECT_EQ(missing, 0U);
  EXPECT_LE(reported.size(), truth + truth / 100);
}
INSTANTIATE_TEST_SUITE_P(Data, Frames, ::testing::Values("cloth-ball", "n-body"));

struct Way {
  FrontMode front;
  BoundsKind bounds;
  int threads;
};

struct Answers {
  std::string hash;
  std::uint64_t contacts = 0;
  std::vector<std::uint64_t> triangle_pairs;
};

Answers step_through(FrameSequence& frames, const Way& way, double separation, int first, int count) {
  const auto scene = scene_of(frames.mesh());
  Collider engine =
      real_collider(scene, frames.read(first),
                    {.min_separation = separation, .front = way.front, .bounds = way.bounds}, way.threads);
  ContactHash hash;
  Answers answers;
  for (int k = first + 1; k <= first + count; ++k) {
    const std::vector<float> positions = frames.read(k);
    const auto result = engine.step(std::span<const float>(positions));
    EXPECT_TRUE(result.ok());
    EXPECT_TRUE(engine.self_check().ok());
    hash.add_step(*scene, result.value().contacts);
    answers.contacts += result.value().contacts.size();
    answers.triangle_pairs.push_back(result.value().statistics.counts.triangle_pairs);
  }
  answers.hash = hash.hex();
  return answers;
}

class Sequences : public ::testing::TestWithParam<std::pair<const char*, double>> {};

// A few frames from the thick of each sequence; the commands of tests/README.md do whole ones.
TEST_P(Sequences, AllWaysGiveTheSameBits) {
  WARMFRONT_NEED_DATA("sequences");
  const auto [name, separation] = GetParam();
  FrameSequence frames(testing::data_root() / "sequences" / name);
  const int first = frames.count() / 2;
  const int count = 4;
  for (const double d : {0.0, separation}) {
    const Way reference{FrontMode::kNone, BoundsKind::kKDop18, 1};
    const Answers expected = step_through(frames, reference, d, first, count);
    std::cout << name << " at separation " << d << ": " << expected.contacts << " contacts, " << expected.hash
              << "\n";
    if (d > 0) {
      EXPECT_GT(expected.contacts, 1000U);
    }
    for (const Way& way :
         {Way{FrontMode::kPaper, BoundsKind::kKDop18, 2}, Way{FrontMode::kWarm, BoundsKind::kKDop18, 8},
          Way{FrontMode::kNone, BoundsKind::kAabb, 2}, Way{FrontMode::kPaper, BoundsKind::kAabb, 8},
          Way{FrontMode::kWarm, BoundsKind::kAabb, 1}}) {
      const Answers answers = step_through(frames, way, d, first, count);
      EXPECT_EQ(answers.hash, expected.hash) << to_string(way.front) << " " << to_string(way.bounds);
      if (way.bounds == reference.bounds) {
        EXPECT_EQ(answers.triangle_pairs, expected.triangle_pairs) << to_string(way.front);
      }
    }
  }
}

// update(front) == build(front), over every frame.
TEST_P(Sequences, UpdatedFrontEqualsBuiltFront) {
  WARMFRONT_NEED_DATA("sequences");
  FrameSequence frames(testing::data_root() / "sequences" / GetParam().first);
  const auto to_doubles = [](const std::vector<float>& x) { return std::vector<double>(x.begin(), x.end()); };
  const auto scene = scene_of(frames.mesh());
  testing::Hierarchy<KDop18> hierarchy(scene, to_doubles(frames.read(0)), 4);
  Workers workers(2);
  testing::CountingSinks sinks;
  Front<KDop18> warm;
  Front<KDop18> cold;
  workers.run([&] { testing::build(warm, hierarchy, sinks); });
  std::uint64_t changed = 0;
  for (int k = 1; k < frames.count(); ++k) {
    hierarchy.step(to_doubles(frames.read(k)));
    workers.run([&] {
      testing::advance(warm, hierarchy, sinks);
      testing::build(cold, hierarchy, sinks);
    });
    ASSERT_TRUE(warm.pairs() == cold.pairs()) << "frame " << k;
    changed += warm.counts().sprouted + warm.counts().pruned;
  }
  EXPECT_GT(changed, 0U);
}

INSTANTIATE_TEST_SUITE_P(Data, Sequences,
                         ::testing::Values(std::pair("bart-like", 0.05), std::pair("n-body", 0.05),
                                           std::pair("cloth-ball-10k", 0.03), std::pair("flamenco", 0.01),
                                           std::pair("cloth-ball", 0.005)),
                         [](const auto& info) {
                           std::string name = info.param.first;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace warmfront
