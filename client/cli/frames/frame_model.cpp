// SPDX-License-Identifier: Apache-2.0
#include "client/cli/frames/frame_model.h"

#include <algorithm>
#include <string>
#include <type_traits>
#include <utility>

#include "client/cli/frames/model_summary.h"
#include "client/cli/frames/pose_fit.h"

namespace warmfront::client {

Result<SendMode> parse_send_mode(std::string_view name, const SceneDescription* scene) {
  if (name.empty())
    return scene != nullptr && screw_count(scene->bodies) > 0 ? SendMode::kPoses : SendMode::kAll;
  if (name == "all") return SendMode::kAll;
  if (name == "moved") return SendMode::kMoved;
  if (name == "poses") return SendMode::kPoses;
  return invalid_argument("--send takes all, moved or poses, not '" + std::string(name) + "'");
}

Result<BodiesMode> parse_bodies_mode(std::string_view name) {
  if (name == "declared") return BodiesMode::kDeclared;
  if (name == "deformable") return BodiesMode::kDeformable;
  if (name == "components") return BodiesMode::kComponents;
  return invalid_argument("--bodies takes declared, deformable or components, not '" + std::string(name) +
                          "'");
}

Result<SceneDescription> with_bodies(SceneDescription description, BodiesMode mode) {
  if (mode == BodiesMode::kDeclared) return description;
  if (has_half_spaces(description))
    return invalid_argument("--bodies: the scene's half-spaces are bodies, and would be lost; use declared");
  if (std::ranges::any_of(description.bodies, [](const Body& body) { return body.thickness != 0; })) {
    // How thick bodies are is no matter of the model.
    const Result<Scene> declared = Scene::create(description);
    if (!declared) return declared.error();
    description.thickness.resize(description.vertex_count);
    for (std::uint32_t v = 0; v < description.vertex_count; ++v)
      description.thickness[v] = declared.value().thickness_of(v);
  }
  description.bodies.clear();
  description.excluded_pairs.clear();
  if (mode == BodiesMode::kDeformable) return description;
  const Result<Scene> scene = Scene::create(description);
  if (!scene) return scene.error();
  const std::span<const std::uint32_t> component = scene.value().body_of_vertex();
  for (std::uint32_t v = 0; v < component.size(); ++v) {
    if (component[v] == description.bodies.size()) {
      description.bodies.push_back({"", v, 0});
    } else if (component[v] + 1 != description.bodies.size()) {
      return invalid_argument("--bodies components: vertex " + std::to_string(v) +
                              " is of a component whose vertices are no range; reorder the mesh");
    }
    ++description.bodies.back().vertex_count;
  }
  return description;
}

FrameModel::FrameModel(const SceneDescription& scene, SendMode mode, const Positions& first)
    : scene_(scene), mode_(mode) {
  std::visit([&](auto values) { rest_.assign(values.begin(), values.end()); }, first);
  placed_ = rest_;
  poses_before_.resize(screw_count(scene.bodies));
  twists_.resize(poses_before_.size());
}

Frame FrameModel::next(const Positions& end) {
  if (const auto* floats = std::get_if<std::span<const float>>(&end)) return next_of(*floats, floats_);
  return next_of(std::get<std::span<const double>>(end), doubles_);
}

// In float32 poses are sent as float32, so fit these.
template <class Real>
void FrameModel::pose(std::uint32_t index, std::span<const Real> end) {
  const Body& body = scene_.bodies[index];
  const std::size_t first = std::size_t{3} * body.first_vertex;
  const std::size_t count = std::size_t{3} * body.vertex_count;
  const std::vector<double> to(end.begin() + static_cast<std::ptrdiff_t>(first),
                               end.begin() + static_cast<std::ptrdiff_t>(first + count));
  const std::span<const double> rest = std::span(rest_).subspan(first, count);
  PoseFit fit = fit_pose(rest, to);
  if constexpr (std::is_same_v<Real, float>) fit.pose = in_float32(fit.pose);
  residual_ = std::max(residual_, fit.residual);
  for (std::size_t i = 0; i < count; i += 3)
    std::ranges::copy(fit.pose.place(rest.data() + i),
                      placed_.begin() + static_cast<std::ptrdiff_t>(first + i));
  poses_.push_back({index, fit.pose});
}

template <class Real>
Frame FrameModel::next_of(std::span<const Real> end, std::vector<Real>& rows) {
  if (mode_ == SendMode::kAll) {
    placed_.assign(end.begin(), end.end());
    bytes_ = end.size_bytes();
    return Frame(end);
  }
  bodies_.clear();
  poses_.clear();
  vertices_.clear();
  rows.clear();
  const auto take = [&](std::uint32_t first, std::uint32_t count, std::uint32_t body, bool whole) {
    const std::size_t begin = vertices_.size();
    for (std::uint32_t v = first; v < first + count; ++v) {
      bool moved = false;
      for (std::size_t i = 3 * std::size_t{v}; i < 3 * std::size_t{v} + 3; ++i) {
        moved |= placed_[i] != end[i];
        placed_[i] = end[i];
      }
      if (moved) vertices_.push_back(v);
    }
    // A whole body takes fewer bytes than most of its vertices.
    if (body < scene_.bodies.size() && vertices_.size() > begin &&
        (whole || 4 * (vertices_.size() - begin) > 3 * count)) {
      vertices_.resize(begin);
      bodies_.push_back({body, end.subspan(3 * std::size_t{first}, 3 * std::size_t{count})});
      bytes_ += 4 + 3 * sizeof(Real) * count;
    }
  };
  bytes_ = 0;
  if (scene_.bodies.empty()) take(0, scene_.vertex_count, 0, false);
  for (std::uint32_t b = 0; b < scene_.bodies.size(); ++b) {
    const Body& body = scene_.bodies[b];
    const bool rigid = body.kind == BodyKind::kRigid;
    if (body.kind == BodyKind::kRemoved || body.half_space) continue;  // frames of files move no half-space
    if (rigid && mode_ == SendMode::kPoses)
      pose(b, end);
    else
      take(body.first_vertex, body.vertex_count, b, rigid);
  }
  for (const std::uint32_t v : vertices_) {
    for (int axis = 0; axis < 3; ++axis) rows.push_back(end[std::size_t{3} * v + axis]);
  }
  std::size_t along_screw = 0;
  for (const BodyPose& posed : poses_) {
    if (!scene_.bodies[posed.body].screw) continue;
    twists_[along_screw] = twist_between(poses_before_[along_screw], posed.pose);
    poses_before_[along_screw++] = posed.pose;
  }
  bytes_ += poses_.size() * 12 * sizeof(Real) + vertices_.size() * (4 + 3 * sizeof(Real));
  Frame frame;
  frame.bodies = bodies_;
  frame.poses = poses_;
  frame.vertices = vertices_;
  frame.vertex_positions = std::span<const Real>(rows);
  return frame;
}

}  // namespace warmfront::client
