// SPDX-License-Identifier: Apache-2.0
// What thickness costs and when it is refused, by examples.
#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "engine/collider.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

// A fat rod on a thin cloth: that the rod is thick makes no pairs within the cloth.
TEST(Thickness, ThatOfOneBodyCostsNothingWithinAnother) {
  SceneDescription description{169, testing::grid(12), {{"cloth", 0, 169}}};
  std::vector<double> x;
  for (int i = 0; i <= 12; ++i)
    for (int j = 0; j <= 12; ++j) x.insert(x.end(), {1.0 * i, 1.0 * j, 0});
  const auto add = [&](double thickness) {
    SceneDescription with = description;
    with.vertex_count = 172;
    with.faces.push_back({169, 170, 171});
    with.bodies.push_back({"rod", 169, 3});
    with.bodies.back().thickness = thickness;
    return std::make_shared<const Scene>(Scene::create(std::move(with)).value());
  };
  x.insert(x.end(), {2, 6, 0.9, 10, 6, 0.9, 6, 6, 0.9});
  const auto ask = [&](double thickness) {
    Collider collider = Collider::create(add(thickness), std::span<const double>(x), {.min_separation = 0.01},
                                         testing::workers())
                            .value();
    return collider.step(Frame()).value();
  };
  const StepResult thin = ask(0);
  const StepResult thick = ask(1);
  EXPECT_EQ(thin.vf + thin.ee, 0U);
  EXPECT_GT(thick.vf + thick.ee, 20U);
  // The rod's one triangle meets each of the cloth's at most.
  EXPECT_LE(thick.statistics.counts.triangle_pairs, thin.statistics.counts.triangle_pairs + 288);
}

std::optional<ErrorCode> code(const Status& status) {
  return status.ok() ? std::nullopt : std::optional(status.error().code);
}

TEST(Thickness, IsRefusedWhereItMeansNothing) {
  const auto create = [](std::vector<double> thickness, double of_body = 0) {
    SceneDescription description{4, testing::tetrahedron(), {{"", 0, 4}}};
    description.thickness = std::move(thickness);
    description.bodies[0].thickness = of_body;
    return Scene::create(std::move(description));
  };
  EXPECT_EQ(create({1, 2}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(create({0, 0, -1, 0}).error().message.substr(0, 12), "thickness[2]");
  EXPECT_EQ(create({0, 0, 0, std::nan("")}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(create({}, std::numeric_limits<double>::infinity()).error().message.substr(0, 19),
            "bodies[0].thickness");
  const std::vector<double> x{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::span<const double> still = x;
  const auto thick = std::make_shared<const Scene>(create({}, 0.1).value());
  const auto fast = Collider::create(thick, still, {.tier = Tier::kFast}, testing::workers());
  EXPECT_EQ(fast.error().code, ErrorCode::kInvalidArgument);
  Collider collider = Collider::create(thick, still, {}, testing::workers()).value();
  EXPECT_FALSE(collider.trial(still, {.tier = Tier::kFast}).ok());
  EXPECT_FALSE(collider.trial(still, {.min_separation = 1e308}).ok());
  EXPECT_TRUE(collider.trial(still).ok());
  // Of a session in tier fast no body becomes thick.
  const auto thin = std::make_shared<const Scene>(create({}).value());
  Collider plain = Collider::create(thin, still, {.tier = Tier::kFast}, testing::workers()).value();
  EXPECT_EQ(code(plain.change_body(0, thick->bodies()[0])), ErrorCode::kInvalidArgument);
  EXPECT_EQ(plain.scene().bodies()[0].thickness, 0);
  EXPECT_TRUE(plain.step(still).ok());
}

}  // namespace
}  // namespace warmfront
