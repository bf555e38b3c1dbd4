// SPDX-License-Identifier: Apache-2.0
// A scene at the extremes of scale and offset through a daemon: the bits of this process, for powers of two
// those of the scene itself, in memory that does not depend on where the scene lies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/client.h"
#include "engine/contact_hash.h"
#include "tests/support/cloth_over_ball.h"
#include "tests/unit/server/answer_hash.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {
namespace {

using client::Client;
using testing::ClothOverBall;
using testing::placed;
using Doubles = std::span<const double>;

struct Outcome {
  std::string hash;
  std::uint64_t contacts = 0;
  std::uint64_t front_bytes = 0;  ///< largest of all steps
};

Outcome through_daemon(Client& client, const ClothOverBall& cloth, int exponent, double offset) {
  auto session = client.create_session(cloth.description,
                                       Doubles(placed(cloth.frames.front(), exponent, offset)), {}, {});
  EXPECT_TRUE(session.ok()) << session.error().message;
  ContactHash hash;
  Outcome outcome;
  for (std::size_t k = 1; k < cloth.frames.size(); ++k) {
    const Result<client::Answer> step =
        session.value().step(Doubles(placed(cloth.frames[k], exponent, offset)));
    EXPECT_TRUE(step.ok()) << step.error().message;
    const client::Answer& answer = step.value();
    add_to(hash, answer);
    outcome.contacts += answer.contacts.size();
    outcome.front_bytes = std::max(outcome.front_bytes, answer.statistics.counts.front_bytes);
  }
  EXPECT_TRUE(session.value().close().ok());
  outcome.hash = hash.hex();
  return outcome;
}

std::string in_this_process(const ClothOverBall& cloth, int exponent, double offset) {
  const auto scene = std::make_shared<const Scene>(std::move(Scene::create(cloth.description)).value());
  const auto start = placed(cloth.frames.front(), exponent, offset);
  Collider collider = Collider::create(scene, Doubles(start), {}, std::make_shared<Workers>(1)).value();
  ContactHash hash;
  for (std::size_t k = 1; k < cloth.frames.size(); ++k) {
    const auto next = placed(cloth.frames[k], exponent, offset);
    hash.add_step(*scene, collider.step(Doubles(next)).value().contacts);
  }
  return hash.hex();
}

TEST(ExtremeScenesThroughADaemon, AreAnsweredCorrectlyInBoundedMemory) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const ClothOverBall cloth = testing::cloth_over_ball(40, 5);  // 4,720 triangles
  const Outcome plain = through_daemon(client, cloth, 0, 0);
  EXPECT_GT(plain.contacts, 1000U);
  for (const auto& [exponent, offset] :
       {std::pair(-1000, 0.0), std::pair(-500, 0.0), std::pair(500, 0.0), std::pair(900, 0.0),
        std::pair(0, 0x1p10), std::pair(0, 0x1p20), std::pair(0, 0x1p30), std::pair(-600, 0x1p-580)}) {
    const Outcome outcome = through_daemon(client, cloth, exponent, offset);
    EXPECT_EQ(outcome.hash, in_this_process(cloth, exponent, offset)) << exponent << " " << offset;
    if (offset == 0) {
      EXPECT_EQ(outcome.hash, plain.hash) << exponent;
    }
    EXPECT_LE(outcome.front_bytes, 2 * plain.front_bytes) << exponent << " " << offset;
  }
}

}  // namespace
}  // namespace warmfront::test
