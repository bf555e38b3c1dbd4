// SPDX-License-Identifier: Apache-2.0
#include "client/lib/scene_state.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "client/lib/wire.h"
#include "engine/motion/check_positions.h"
#include "engine/part_way.h"
#include "engine/scene/description_checks.h"
#include "engine/screw.h"

namespace warmfront::client {
namespace {

std::string_view bytes_of(const Positions& positions) {
  return std::visit(
      [](auto span) {
        return std::string_view(reinterpret_cast<const char*>(span.data()), span.size_bytes());
      },
      positions);
}

bool is_float32(const Positions& positions) {
  return std::holds_alternative<std::span<const float>>(positions);
}

std::string at(const char* field, std::size_t index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

template <class T>
void append_value(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
T value_at(std::string_view bytes, std::size_t index) {
  T value;
  std::memcpy(&value, bytes.data() + index * sizeof(T), sizeof value);
  return value;
}

/// Where it is no frame says: one of all positions repeats them, or gives for what was removed anything.
bool stays(const Body& body) {
  return body.kind == BodyKind::kStatic || body.kind == BodyKind::kRemoved;
}

}  // namespace

SceneState::SceneState(SceneDescription scene, const Positions& positions)
    : scene_(std::move(scene)),
      float32_(is_float32(positions)),
      positions_(FrameBytes::copy_of(bytes_of(positions), nullptr)),
      poses_(scene_.bodies.size()) {
  scene_.filters.rest_at(positions);
  if (scene_.thickness.size() == scene_.vertex_count) forget_zero_thickness();  // another number is refused
}

void SceneState::forget_zero_thickness() {
  if (std::ranges::all_of(scene_.thickness, [](double thickness) { return thickness == 0; }))
    scene_.thickness.clear();
}

std::vector<double> SceneState::placed() const {
  std::vector<double> placed(3 * std::size_t{scene_.vertex_count});
  const std::string_view rows = positions();
  for (std::size_t i = 0; i < placed.size(); ++i)
    placed[i] = float32_ ? value_at<float>(rows, i) : value_at<double>(rows, i);
  for (std::size_t b = 0; b < poses_.size(); ++b) {
    if (!poses_[b]) continue;
    const Body& body = scene_.bodies[b];
    double* row = placed.data() + std::size_t{3} * body.first_vertex;
    for (std::uint32_t v = 0; v < body.vertex_count; ++v, row += 3)
      std::ranges::copy(poses_[b]->place(row), row);
  }
  return placed;
}

std::vector<BodyPose> SceneState::poses() const {
  std::vector<BodyPose> poses;
  for (std::uint32_t b = 0; b < poses_.size(); ++b) {
    if (scene_.bodies[b].kind == BodyKind::kRigid) poses.push_back({b, poses_[b].value_or(Pose{})});
  }
  return poses;
}

void SceneState::describe(v1::SessionHeader& header) const {
  header.set_vertex_count(scene_.vertex_count);
  header.set_face_count(static_cast<std::uint32_t>(scene_.faces.size()));
  header.set_edge_count(static_cast<std::uint32_t>(scene_.edges.size()));
  header.set_dtype(float32_ ? v1::DTYPE_FLOAT32 : v1::DTYPE_FLOAT64);
  header.clear_bodies();
  header.clear_pose_bodies();
  header.clear_poses();
  header.clear_filters();
  header.set_vertex_thickness(!scene_.thickness.empty());
  if (!(scene_.filters == PairFilters())) *header.mutable_filters() = wire::header_of(scene_.filters);
  for (const Body& body : scene_.bodies) *header.add_bodies() = to_proto(body);
  wire::set_body_pairs(*header.mutable_excluded_pairs(), scene_.excluded_pairs);
  for (std::uint32_t b = 0; b < poses_.size(); ++b) {
    if (!poses_[b] || scene_.bodies[b].kind == BodyKind::kRemoved) continue;
    append_value(*header.mutable_pose_bodies(), b);
    append_value(*header.mutable_poses(), poses_[b]->matrix);
  }
}

Status SceneState::check_kind(const Positions& positions, std::size_t vertices,
                              const std::string& where) const {
  const std::size_t count = std::visit([](auto span) { return span.size(); }, positions);
  if (Status status = check_count(count, static_cast<std::uint32_t>(vertices), where); !status) return status;
  if (count > 0 && is_float32(positions) != float32_)
    return invalid_argument(where + ": the session was created with " + (float32_ ? "float32" : "float64") +
                            " positions; give every frame the same kind");
  return {};
}

Status SceneState::check_index(std::uint32_t index) const {
  return check_body_number("index", index, scene_.bodies.size());
}

bool SceneState::gives_all(const Frame& frame) const {
  return frame.positions && frame.bodies.empty() && frame.poses.empty() && frame.vertices.empty() &&
         check_kind(*frame.positions, scene_.vertex_count, "positions").ok();
}

Result<SentFrame> SceneState::encode(const Frame& frame, SharedRegion* region) const {
  SentFrame sent;
  if (frame.positions) {
    if (!frame.bodies.empty() || !frame.poses.empty() || !frame.vertices.empty())
      return invalid_argument(
          "positions: the frame gives all vertices and also parts; give only one of them");
    if (Status status = check_kind(*frame.positions, scene_.vertex_count, "positions"); !status)
      return status.error();
    sent.positions = FrameBytes::copy_of(bytes_of(*frame.positions), region);
    return sent;
  }
  v1::MovedParts& moved = sent.moved.emplace();
  for (std::size_t i = 0; i < frame.bodies.size(); ++i) {
    const auto& [body, positions] = frame.bodies[i];
    if (Status status = check_body_number(at("bodies", i), body, scene_.bodies.size()); !status)
      return status.error();
    if (scene_.bodies[body].half_space) {
      append_value(*moved.mutable_bodies(), body);  // which the daemon refuses: it moves by poses
      continue;
    }
    if (Status status = check_kind(positions, scene_.bodies[body].vertex_count, "positions"); !status)
      return of_body(at("bodies", i), body, scene_.bodies[body], status.error());
    append_value(*moved.mutable_bodies(), body);
    moved.mutable_body_positions()->append(bytes_of(positions));
  }
  std::vector<std::uint32_t> posed;
  for (const auto& [body, pose] : frame.poses) {
    posed.push_back(body);
    for (const double number : pose.matrix) {
      if (float32_)
        append_value(*moved.mutable_poses(), static_cast<float>(number));
      else
        append_value(*moved.mutable_poses(), number);
    }
  }
  // Poses of all rigid bodies in order need no body indices.
  std::vector<std::uint32_t> rigid;
  for (std::uint32_t b = 0; b < scene_.bodies.size(); ++b) {
    if (scene_.bodies[b].kind == BodyKind::kRigid) rigid.push_back(b);
  }
  if (posed != rigid) {
    for (const std::uint32_t body : posed) append_value(*moved.mutable_pose_bodies(), body);
  }
  if (Status status = check_kind(frame.vertex_positions, frame.vertices.size(), "vertex_positions"); !status)
    return status.error();
  moved.mutable_vertices()->assign(reinterpret_cast<const char*>(frame.vertices.data()),
                                   frame.vertices.size_bytes());
  moved.mutable_vertex_positions()->assign(bytes_of(frame.vertex_positions));
  return sent;
}

std::string& SceneState::own_positions() {
  if (!own_) {
    own_.emplace(positions_.view());
    positions_ = {};
  }
  return *own_;
}

template <class Real>
void SceneState::move_part_way(std::uint32_t first, const char* bytes, std::size_t vertices,
                               const std::optional<Pose>& pose, double fraction) {
  char* to = own_positions().data() + 3 * sizeof(Real) * first;
  for (std::size_t v = 0; v < vertices; ++v, to += 3 * sizeof(Real), bytes += 3 * sizeof(Real)) {
    std::array<Real, 3> from_row, to_row;
    std::memcpy(from_row.data(), to, sizeof from_row);
    std::memcpy(to_row.data(), bytes, sizeof to_row);
    std::array<double, 3> from{from_row[0], from_row[1], from_row[2]};
    if (pose) from = pose->place(from.data());
    const std::array<double, 3> there{to_row[0], to_row[1], to_row[2]};
    // What is given where it was has not moved: a zero keeps its sign.
    if (std::memcmp(from.data(), there.data(), sizeof from) != 0) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        to_row[axis] = static_cast<Real>(part_way(from[axis], there[axis], fraction, float32_));
    }
    std::memcpy(to, to_row.data(), sizeof to_row);
  }
}

void SceneState::move_rows(std::uint32_t first, const char* bytes, std::size_t vertices,
                           const std::optional<Pose>& pose, double fraction) {
  if (fraction == 1)
    std::memcpy(own_positions().data() + 3 * number_size() * first, bytes, 3 * number_size() * vertices);
  else if (float32_)
    move_part_way<float>(first, bytes, vertices, pose, fraction);
  else
    move_part_way<double>(first, bytes, vertices, pose, fraction);
}

// What stays has the bits that it had: 0 may be given for -0, which would be a motion to who looks closely.
void SceneState::take_all(const FrameBytes& positions) {
  const auto rows_in = [this](std::string_view all, const Body& body) {
    const std::size_t row = 3 * number_size();
    return all.substr(row * body.first_vertex, row * body.vertex_count);
  };
  std::optional<std::string> kept;
  for (const Body& body : scene_.bodies) {
    if (!stays(body)) continue;
    const std::string_view now = rows_in(this->positions(), body);
    const std::string_view given = rows_in(positions.view(), body);
    if (now == given) continue;
    if (!kept) kept.emplace(positions.view());
    now.copy(kept->data() + (given.data() - positions.data()), now.size());
  }
  own_ = std::move(kept);
  positions_ = own_ ? FrameBytes() : positions;
  for (std::size_t b = 0; b < poses_.size(); ++b) {
    if (!scene_.bodies[b].half_space && !stays(scene_.bodies[b])) poses_[b].reset();
  }
}

void SceneState::take(const SentFrame& frame, double fraction) {
  if (fraction == 0) return;
  if (!frame.moved && fraction == 1) return take_all(frame.positions);
  if (!frame.moved) {
    const char* rows = frame.positions.data();
    if (scene_.bodies.empty()) move_rows(0, rows, scene_.vertex_count, std::nullopt, fraction);
    for (std::size_t b = 0; b < scene_.bodies.size(); ++b) {
      const Body& body = scene_.bodies[b];
      if (stays(body) || body.half_space) continue;
      move_rows(body.first_vertex, rows + 3 * number_size() * body.first_vertex, body.vertex_count, poses_[b],
                fraction);
      poses_[b].reset();
    }
    return;
  }
  const v1::MovedParts& moved = *frame.moved;
  const char* rows = moved.body_positions().data();
  for (std::size_t i = 0; i < moved.bodies().size() / 4; ++i) {
    const auto b = value_at<std::uint32_t>(moved.bodies(), i);
    const Body& body = scene_.bodies[b];
    move_rows(body.first_vertex, rows, body.vertex_count, poses_[b], fraction);
    rows += 3 * number_size() * body.vertex_count;
    poses_[b].reset();
  }
  const std::size_t poses = moved.poses().size() / (12 * number_size());
  std::size_t next = 0;  // among all rigid bodies
  for (std::size_t i = 0; i < poses; ++i) {
    std::uint32_t body = 0;
    if (!moved.pose_bodies().empty()) {
      body = value_at<std::uint32_t>(moved.pose_bodies(), i);
    } else {
      while (scene_.bodies[next].kind != BodyKind::kRigid) ++next;
      body = static_cast<std::uint32_t>(next++);
    }
    Pose to;
    for (std::size_t k = 0; k < 12; ++k)
      to.matrix[k] =
          float32_ ? value_at<float>(moved.poses(), 12 * i + k) : value_at<double>(moved.poses(), 12 * i + k);
    const Pose from = poses_[body].value_or(Pose{});
    if (from == to)
      poses_[body] = to;  // as above
    else
      poses_[body] = scene_.bodies[body].screw ? screw_way(from, to, fraction, float32_)
                                               : part_way(from, to, fraction, float32_);
  }
  for (std::size_t i = 0; i < moved.vertices().size() / 4; ++i)
    move_rows(value_at<std::uint32_t>(moved.vertices(), i),
              moved.vertex_positions().data() + 3 * number_size() * i, 1, std::nullopt, fraction);
}

}  // namespace warmfront::client
