// SPDX-License-Identifier: Apache-2.0
// The built-in scenes: the same bits twice, sound topology, the size asked for, and contacts to detect.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/scenes/catalog.h"
#include "client/scenes/math.h"
#include "engine/collider.h"

namespace warmfront::client::scenes {
namespace {

using ::testing::HasSubstr;

class EveryScene : public ::testing::TestWithParam<std::string> {
 protected:
  static SceneSpec spec(const std::string& parameters) {
    const Result<SceneSpec> parsed = parse_scene_spec(GetParam() + "?" + parameters);
    EXPECT_TRUE(parsed.ok());
    return parsed.value();
  }
};

TEST_P(EveryScene, IsTheSameTwice) {
  const auto a = make_animation(spec("triangles=2000"));
  const auto b = make_animation(spec("triangles=2000"));
  EXPECT_EQ(a->scene().faces, b->scene().faces);
  EXPECT_EQ(a->scene().edges, b->scene().edges);
  for (const std::uint32_t frame : {0U, 1U, 12U}) EXPECT_EQ(a->frame(frame), b->frame(frame));
  const std::vector<float> late = a->frame(12);
  EXPECT_NE(a->frame(0), late) << "it moves";
  EXPECT_EQ(a->frame(12), late) << "going back starts again";
}

TEST_P(EveryScene, IsASoundSceneOfAboutTheSizeAskedFor) {
  for (const std::uint32_t triangles : {1'000U, 5'000U, 30'000U}) {
    const auto animation = make_animation(spec("triangles=" + std::to_string(triangles)));
    const SceneDescription& scene = animation->scene();
    EXPECT_NEAR(static_cast<double>(scene.faces.size() + scene.edges.size()), triangles, 0.1 * triangles);
    const Result<Scene> built = Scene::create(scene);
    ASSERT_TRUE(built.ok()) << built.error().message;
    EXPECT_EQ(built.value().isolated_vertices().empty(), GetParam() != "particles");
    for (std::size_t e = 0; e < built.value().edge_count(); ++e)
      ASSERT_LE(built.value().edge_faces()[e].size(), 2U) << "edge " << e << " is not manifold";
    EXPECT_GE(scene.bodies.size(), 2U);
    EXPECT_EQ(animation->frame(0).size(), 3 * std::size_t{scene.vertex_count});
  }
}

TEST_P(EveryScene, StaysFiniteAndHasContacts) {
  const auto animation = make_animation(spec("triangles=2000"));
  Result<Scene> scene = Scene::create(animation->scene());
  ASSERT_TRUE(scene.ok());
  const Positions first = std::span(animation->frame(0));
  Result<Collider> collider = Collider::create(std::make_shared<const Scene>(std::move(scene).value()), first,
                                               {}, std::make_shared<Workers>(2));
  ASSERT_TRUE(collider.ok()) << collider.error().message;
  std::uint64_t contacts = 0;
  std::uint64_t frames_with = 0;
  for (std::uint32_t frame = 1; frame < 40; ++frame) {
    const std::vector<float>& positions = animation->frame(frame);
    for (const float x : positions) ASSERT_TRUE(std::isfinite(x) && std::abs(x) < 10) << "frame " << frame;
    const Result<StepResult> step = collider.value().step(std::span(positions));
    ASSERT_TRUE(step.ok()) << step.error().message;
    contacts += step.value().total();
    frames_with += step.value().total() > 0;
  }
  EXPECT_GE(contacts, 20U);
  EXPECT_GE(frames_with, 5U);
}

INSTANTIATE_TEST_SUITE_P(Builtin, EveryScene,
                         ::testing::Values("cloth-ball", "flamenco", "n-body", "princess", "bart", "hair",
                                           "particles", "ground", "torn", "cut", "turning"),
                         [](const auto& param) {
                           std::string name = param.param;
                           for (char& c : name)
                             if (c == '-') c = '_';
                           return name;
                         });

// However fine the cloth, all particles come to lie on it, none falls through, and there is no floor that the
// scene lacks.
TEST(Particles, RestOnTheCloth) {
  for (const std::uint32_t triangles : {1'000U, 4'000U, 20'000U}) {
    SCOPED_TRACE(triangles);
    const auto animation =
        make_animation(parse_scene_spec("particles?triangles=" + std::to_string(triangles)).value());
    const SceneDescription& scene = animation->scene();
    const std::uint32_t particles = scene.bodies[1].first_vertex;
    const double cell = 2 / std::sqrt(scene.faces.size() / 2.0);
    for (const std::uint32_t frame : {15U, 30U, 59U}) {
      const std::vector<float>& x = animation->frame(frame);
      const auto at = [&](std::uint32_t v) { return Vec3{x[3 * v], x[3 * v + 1], x[3 * v + 2]}; };
      std::map<std::pair<int, int>, std::vector<std::uint32_t>> columns;  // of the cloth, from above
      const double wide = 2 * cell;
      const auto column = [&](Vec3 p) {
        return std::pair(static_cast<int>(std::floor(p.x / wide)), static_cast<int>(std::floor(p.y / wide)));
      };
      double lowest = 9;
      for (std::uint32_t v = 0; v < particles; ++v) {
        columns[column(at(v))].push_back(v);
        lowest = std::min(lowest, at(v).z);
      }
      EXPECT_GT(lowest, 0.5) << "the floor is at 0";
      std::size_t below = 0, above = 0;
      for (std::uint32_t p = particles; p < scene.vertex_count; ++p) {
        const auto [i, j] = column(at(p));
        double under = -9, nearest = 9;
        for (int a = i - 1; a <= i + 1; ++a)
          for (int b = j - 1; b <= j + 1; ++b)
            for (const std::uint32_t v : columns[{a, b}]) {
              const Vec3 apart = at(p) - at(v);
              if (norm(apart) < nearest) under = apart.z;
              nearest = std::min(nearest, norm(apart));
            }
        below += under < -0.1 * cell;
        above += nearest > 1.5 * cell;
      }
      EXPECT_EQ(below, 0U) << "frame " << frame;
      if (frame < 59) continue;
      EXPECT_LE(above, (scene.vertex_count - particles) / 50) << "not at rest yet";
    }
  }
}

// Each part is a sound scene, and begins where the one before it ends, but for the vertices that came apart.
TEST(Cut, ChangesItsTopologyAsItIsTorn) {
  const auto animation = make_animation(parse_scene_spec("cut?triangles=3000&frames=50").value());
  const auto whole = make_animation(parse_scene_spec("torn?triangles=3000&frames=50").value());
  const std::vector<std::uint32_t> changes = animation->changes();
  ASSERT_GE(changes.size(), 20U);
  std::set<std::array<float, 3>> before;
  for (std::size_t part = 0; part <= changes.size(); ++part) {
    SCOPED_TRACE("part " + std::to_string(part));
    const SceneDescription scene = animation->scene(part);
    const Result<Scene> built = Scene::create(scene);
    ASSERT_TRUE(built.ok()) << built.error().message;
    EXPECT_TRUE(built.value().isolated_vertices().empty());
    EXPECT_EQ(scene.faces.size(), whole->scene().faces.size());
    std::size_t boundary = 0;
    for (std::size_t e = 0; e < built.value().edge_count(); ++e)
      boundary += built.value().edge_faces()[e].size() == 1;
    const auto rows_of = [&](std::uint32_t frame) {
      std::set<std::array<float, 3>> rows;
      const std::vector<float>& positions = animation->frame(frame, part);
      EXPECT_EQ(positions.size(), 3 * std::size_t{scene.vertex_count});
      for (std::size_t i = 0; i < positions.size(); i += 3)
        rows.insert({positions[i], positions[i + 1], positions[i + 2]});
      return rows;
    };
    if (part == 0) {
      EXPECT_EQ(boundary % 4, 0U) << "four sides";
    } else {
      std::set<std::array<float, 3>> now = rows_of(changes[part - 1]);
      const std::size_t all = now.size();
      for (const auto& row : before) now.erase(row);
      EXPECT_GE(now.size(), 2U) << "something came apart";
      EXPECT_LE(now.size(), all / 10);
    }
    before = rows_of(part < changes.size() ? changes[part] : 49);
  }
  EXPECT_EQ(animation->scene(changes.size()).faces, whole->scene().faces) << "all of the seam is torn";
  EXPECT_EQ(animation->frame(49, changes.size()), whole->frame(49));
  EXPECT_TRUE(make_animation(parse_scene_spec("cut?frames=11").value())->changes().empty())
      << "it is shorter";
}

TEST(Catalog, NamesAndParametersAreChecked) {
  const auto error = [](std::string_view text) {
    const Result<SceneSpec> spec = parse_scene_spec(text);
    return spec ? std::string() : spec.error().message;
  };
  EXPECT_EQ(error("builtin:n-body?frames=2&triangles=1000"), "");
  EXPECT_EQ(error("n-body"), "");
  EXPECT_THAT(error("builtin:"), HasSubstr("there are: cloth-ball"));
  EXPECT_THAT(error("bart?size=3"), HasSubstr("no scene parameter 'size'; there are: triangles, frames"));
  EXPECT_THAT(error("bart?triangles=999"), HasSubstr("[1000, 1000000]"));
  EXPECT_THAT(error("bart?frames=1"), HasSubstr("[2, 10000]"));
  for (const char* bad :
       {"bart?frames", "bart?frames=", "bart?frames=-3", "bart?frames=3x", "bart?frames=99999999999"})
    EXPECT_NE(error(bad), "") << bad;
  EXPECT_EQ(catalog().size(), 11U);
}

TEST(Math, OurSineIsTheSine) {
  for (double angle = -20; angle < 20; angle += 0.0137) {
    EXPECT_NEAR(sin_cos(angle).sin, std::sin(angle), 1e-14);
    EXPECT_NEAR(sin_cos(angle).cos, std::cos(angle), 1e-14);
  }
}

}  // namespace
}  // namespace warmfront::client::scenes
