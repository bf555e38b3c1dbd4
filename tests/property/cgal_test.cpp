// SPDX-License-Identifier: Apache-2.0
// Intersections against CGAL's on recorded frames, as they are and crumpled by noise: a second oracle, which
// shares no code and no predicate with the engine. Skipped where it was built without CGAL (libcgal-dev), and
// where there are no recordings.
#include <gtest/gtest.h>

#ifdef WARMFRONT_HAS_CGAL
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#endif

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "engine/collider.h"
#include "tests/support/data.h"
#include "tests/support/real_scene.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

#ifdef WARMFRONT_HAS_CGAL
using FacePairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  // sorted, each once

FacePairs sorted(FacePairs pairs) {
  for (auto& [f, g] : pairs)
    if (g < f) std::swap(f, g);
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

int shared(const Face& f, const Face& g) {
  return static_cast<int>(
      std::ranges::count_if(f, [&](std::uint32_t v) { return std::ranges::find(g, v) != g.end(); }));
}

// Of faces that meet elsewhere than in what they share, those that share no edge: of neighbours that fold
// onto each other along a common edge the engine tells nothing.
FacePairs cgal_pairs(const Scene& scene, const std::vector<float>& x) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
  Mesh mesh;
  for (std::size_t i = 0; i < x.size(); i += 3) mesh.add_vertex(Kernel::Point_3(x[i], x[i + 1], x[i + 2]));
  for (const Face& face : scene.faces()) {
    const auto at = [&](int k) { return Mesh::Vertex_index(face[k]); };
    EXPECT_NE(mesh.add_face(at(0), at(1), at(2)), Mesh::null_face()) << "no manifold";
  }
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> found;
  CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(found));
  FacePairs pairs;
  for (const auto& [f, g] : found) {
    if (shared(scene.faces()[f], scene.faces()[g]) < 2) pairs.emplace_back(f, g);
  }
  return sorted(std::move(pairs));
}

// An edge that meets a face is of all faces along it.
FacePairs our_pairs(const Scene& scene, std::span<const Contact> rows) {
  FacePairs pairs;
  for (const Contact& row : rows) {
    for (const std::uint32_t f : scene.edge_faces()[row.a]) pairs.emplace_back(f, row.b);
  }
  return sorted(std::move(pairs));
}

bool has_area(const std::vector<float>& x, const Face& face) {
  const auto at = [&](int k, int axis) { return double{x[3 * std::size_t{face[k]} + axis]}; };
  double area = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    area += std::fabs((at(1, u) - at(0, u)) * (at(2, v) - at(0, v)) -
                      (at(1, v) - at(0, v)) * (at(2, u) - at(0, u)));
  }
  return area > 0;
}
#endif

TEST(IntersectionsAndCgal, TellTheSameFacesOfRecordedFrames) {
#ifndef WARMFRONT_HAS_CGAL
  GTEST_SKIP() << "built without CGAL: install libcgal-dev";
#else
  const std::filesystem::path sequences = testing::data_root() / "sequences";
  if (!std::filesystem::exists(sequences)) GTEST_SKIP() << "no recordings in " << sequences;
  std::mt19937 random(5);
  std::size_t plain = 0, crumpled = 0;
  for (const char* name : {"cloth-ball-10k", "flamenco", "n-body", "bart-like"}) {
    testing::FrameSequence sequence(sequences / name);
    SceneDescription description{
        static_cast<std::uint32_t>(sequence.mesh().positions.size() / 3), sequence.mesh().faces, {}};
    const auto scene = std::make_shared<const Scene>(Scene::create(std::move(description)).value());
    Collider collider =
        Collider::create(scene, std::span<const float>(sequence.mesh().positions), {}, testing::workers())
            .value();
    for (const double share : {0.0, 0.5, 0.95}) {
      const std::vector<float> frame = sequence.read(static_cast<int>(share * (sequence.count() - 1)));
      const auto [least, most] = std::ranges::minmax(frame);
      for (const float noise : {0.0F, 2e-3F}) {
        std::vector<float> x = frame;
        std::uniform_real_distribution<float> shift(-noise * (most - least), noise * (most - least));
        if (noise > 0)
          for (float& coordinate : x) coordinate += shift(random);
        if (!std::ranges::all_of(scene->faces(), [&](const Face& face) { return has_area(x, face); }))
          continue;  // of which CGAL does not speak
        ASSERT_TRUE(
            collider.step(Frame(std::span<const float>(x)), nullptr, {}, {.report = Report::kCount}).ok());
        const StepResult told = collider.intersections().value();
        const FacePairs ours = our_pairs(*scene, told.contacts);
        EXPECT_EQ(ours, cgal_pairs(*scene, x)) << name << " at " << share << ", noise " << noise;
        (noise > 0 ? crumpled : plain) += ours.size();
      }
    }
  }
  EXPECT_GT(crumpled, 5'000U);
  RecordProperty("pairs_of_faces", static_cast<int>(plain + crumpled));
#endif
}

}  // namespace
}  // namespace warmfront
