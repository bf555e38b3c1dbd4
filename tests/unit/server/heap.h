// SPDX-License-Identifier: Apache-2.0
// A small scene with every kind of body, and frames that mix all forms of motion. Plain values.
#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "engine/frame.h"
#include "engine/scene.h"
#include "tests/support/scenes.h"

namespace warmfront::test {

/// Five octahedra in a heap: static, two rigid, two deformable.
template <class Real>
struct Heap {
  Heap() {
    const BodyKind kinds[]{BodyKind::kStatic, BodyKind::kRigid, BodyKind::kRigid, BodyKind::kDeformable,
                           BodyKind::kDeformable};
    for (std::uint32_t b = 0; b < 5; ++b) {
      for (auto face : testing::octahedron()) {
        for (auto& v : face) v += static_cast<std::int32_t>(6 * b);
        description.faces.push_back(face);
      }
      description.bodies.push_back({"", 6 * b, 6, kinds[b]});
      append_octahedron(0.7 * b, 0.3 * b, x);
    }
    description.vertex_count = 30;
    description.excluded_pairs = {{1, 4}};
  }
  static void append_octahedron(double at_x, double at_z, std::vector<Real>& to) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        const double at[3] = {at_x, 0, at_z};
        for (int k = 0; k < 3; ++k) to.push_back(static_cast<Real>(at[k] + (k == axis ? sign : 0)));
      }
    }
  }
  SceneDescription description;
  std::vector<Real> x;
};

/// A frame that mixes everything, of step k.
template <class Real>
struct Mixture {
  explicit Mixture(int k, const Heap<Real>& heap) {
    for (std::uint32_t b : {1U, 2U}) {
      const double angle = 0.1 * k + b;
      Pose pose;
      pose.matrix = {
          std::cos(angle), -std::sin(angle), 0, 0.1 * k, std::sin(angle), std::cos(angle), 0, 0, 0, 0, 1,
          0.05 * k};
      if (std::is_same_v<Real, float>) pose = in_float32(pose);  // as it travels
      if (b == 1 || k % 3 != 0) poses.push_back({b, pose});
    }
    body.assign(heap.x.begin() + 54, heap.x.begin() + 72);
    for (Real& value : body) value += static_cast<Real>(0.1 * std::sin(0.7 * k));
    bodies.push_back({3, std::span<const Real>(body)});
    vertices = {24, static_cast<std::uint32_t>(25 + k % 5)};
    for (int i = 0; i < 6; ++i) rows.push_back(static_cast<Real>(0.3 * i - 0.05 * k));
    frame.poses = poses;
    frame.bodies = bodies;
    frame.vertices = vertices;
    frame.vertex_positions = std::span<const Real>(rows);
  }
  std::vector<BodyPose> poses;
  std::vector<Real> body;
  std::vector<BodyPositions> bodies;
  std::vector<std::uint32_t> vertices;
  std::vector<Real> rows;
  Frame frame;
};

}  // namespace warmfront::test
