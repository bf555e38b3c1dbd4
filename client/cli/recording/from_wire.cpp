// SPDX-License-Identifier: Apache-2.0
// Messages to values: see from_wire.h.
#include "client/cli/recording/from_wire.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "client/lib/wire.h"
#include "proto/wire/options.h"
#include "proto/wire/scene.h"

namespace warmfront::client {
namespace {

Error bad_length(const std::string& where, std::size_t bytes, const std::string& expected) {
  return invalid_argument(where + ": " + std::to_string(bytes) + " bytes, but " + expected + " are expected");
}

template <class T>
std::vector<T> values_of(const std::string& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

Result<std::vector<std::uint32_t>> indices_of(const std::string& bytes, const std::string& where) {
  if (bytes.size() % 4 != 0) return bad_length(where, bytes.size(), "a whole number of uint32");
  return values_of<std::uint32_t>(bytes);
}

std::size_t number_size(bool float32) {
  return float32 ? sizeof(float) : sizeof(double);
}

/// A frame's parts concatenated field by field.
v1::MovedParts joined(std::span<const v1::StepFrame> parts) {
  v1::MovedParts all;
  for (const v1::StepFrame& part : parts) {
    const v1::MovedParts& moved = part.moved();
    *all.mutable_bodies() += moved.bodies();
    *all.mutable_body_positions() += moved.body_positions();
    *all.mutable_pose_bodies() += moved.pose_bodies();
    *all.mutable_poses() += moved.poses();
    *all.mutable_vertices() += moved.vertices();
    *all.mutable_vertex_positions() += moved.vertex_positions();
  }
  return all;
}

}  // namespace

Result<ColliderOptions> options_of(const v1::ColliderOptions& message) {
  Result<ColliderOptions> read = wire::options_from(message);
  if (!read) return read.error();
  ColliderOptions options = std::move(read).value();
  options.explain = false;  // the comparison is not part of an answer
  if (Status valid = validate(options); !valid) return valid.error();
  return options;
}

Result<SceneDescription> scene_of(const v1::SessionHeader& header) {
  SceneDescription scene;
  scene.vertex_count = header.vertex_count();
  for (const v1::Body& message : header.bodies()) {
    Result<Body> body = wire::body_from(message, "body \"" + message.name() + "\"");
    if (!body) return body.error();
    scene.bodies.push_back(std::move(body).value());
  }
  scene.excluded_pairs = wire::body_pairs_from(header.excluded_pairs());
  return scene;
}

Result<std::vector<BodyPose>> poses_of(const v1::SessionHeader& header) {
  const auto bodies = indices_of(header.pose_bodies(), "pose_bodies");
  if (!bodies) return bodies.error();
  const std::vector<double> numbers = values_of<double>(header.poses());
  if (header.poses().size() != 96 * bodies.value().size())
    return bad_length("poses", header.poses().size(), "96 a body");
  std::vector<BodyPose> poses;
  for (std::size_t i = 0; i < bodies.value().size(); ++i) {
    BodyPose& pose = poses.emplace_back(BodyPose{bodies.value()[i], {}});
    std::copy_n(numbers.begin() + static_cast<std::ptrdiff_t>(12 * i), 12, pose.pose.matrix.begin());
  }
  return poses;
}

Result<std::vector<std::array<std::int32_t, 3>>> faces_of(const std::string& bytes,
                                                          const std::string& where) {
  if (bytes.size() % 12 != 0) return bad_length(where, bytes.size(), "a whole number of faces");
  return values_of<std::array<std::int32_t, 3>>(bytes);
}

Result<std::vector<std::array<std::int32_t, 2>>> edges_of(const std::string& bytes,
                                                          const std::string& where) {
  if (bytes.size() % 8 != 0) return bad_length(where, bytes.size(), "a whole number of edges");
  return values_of<std::array<std::int32_t, 2>>(bytes);
}

Result<PositionBuffer> positions_of(const std::string& bytes, bool float32, std::uint64_t vertices,
                                    const std::string& where) {
  const std::uint64_t expected = 3 * vertices * number_size(float32);
  if (bytes.size() != expected) return bad_length(where, bytes.size(), std::to_string(expected));
  if (float32) return PositionBuffer(values_of<float>(bytes));
  return PositionBuffer(values_of<double>(bytes));
}

Result<WireFrame> WireFrame::read(std::span<const v1::StepFrame> parts, bool float32, const Scene& scene) {
  for (const v1::StepFrame& part : parts) {
    // What a daemon took from there is in the recording in its place.
    if (part.has_shared_positions() || part.has_shared_moved() || part.has_answer_room())
      return invalid_argument("shared memory: the frame names bytes of it that the daemon did not take");
  }
  WireFrame frame;
  frame.whole_ = std::ranges::none_of(parts, &v1::StepFrame::has_moved);
  std::string whole;
  for (const v1::StepFrame& part : parts) whole += part.positions();
  if (frame.whole_) {
    Result<PositionBuffer> positions = positions_of(whole, float32, scene.vertex_count(), "positions");
    if (!positions) return positions.error();
    frame.positions_ = std::move(positions).value();
    return frame;
  }
  if (!whole.empty()) return invalid_argument("moved: the frame gives all positions as well; give either");

  const v1::MovedParts moved = joined(parts);
  const auto bodies = indices_of(moved.bodies(), "moved.bodies");
  if (!bodies) return bodies.error();
  std::size_t at = 0;
  for (const std::uint32_t body : bodies.value()) {
    if (body >= scene.bodies().size())
      return invalid_argument("moved.bodies: there is no body " + std::to_string(body));
    const std::uint64_t vertices = scene.bodies()[body].vertex_count;
    const std::size_t bytes = 3 * vertices * number_size(float32);
    if (moved.body_positions().size() - at < bytes)
      return invalid_argument("moved.body_positions: " + std::to_string(moved.body_positions().size()) +
                              " bytes, but more are expected for the bodies named");
    auto positions = positions_of(moved.body_positions().substr(at, bytes), float32, vertices, "moved");
    if (!positions) return positions.error();
    frame.body_positions_.push_back(std::move(positions).value());
    frame.bodies_.push_back({body, {}});
    at += bytes;
  }
  if (at != moved.body_positions().size())
    return invalid_argument("moved.body_positions: " + std::to_string(moved.body_positions().size()) +
                            " bytes, but " + std::to_string(at) + " are expected for the bodies named");
  for (std::size_t i = 0; i < frame.bodies_.size(); ++i)
    frame.bodies_[i].positions = view(frame.body_positions_[i]);

  auto posed = indices_of(moved.pose_bodies(), "moved.pose_bodies");
  if (!posed) return posed.error();
  if (posed.value().empty() && !moved.poses().empty()) {
    for (std::uint32_t b = 0; b < scene.bodies().size(); ++b)
      if (scene.bodies()[b].kind == BodyKind::kRigid) posed.value().push_back(b);
  }
  // A pose is four columns of three.
  auto poses = positions_of(moved.poses(), float32, 4 * posed.value().size(), "moved.poses");
  if (!poses) return poses.error();
  for (std::size_t i = 0; i < posed.value().size(); ++i) {
    BodyPose& pose = frame.poses_.emplace_back(BodyPose{posed.value()[i], {}});
    for (std::size_t k = 0; k < 12; ++k) pose.pose.matrix[k] = coordinate(view(poses.value()), 12 * i + k);
  }

  auto vertices = indices_of(moved.vertices(), "moved.vertices");
  if (!vertices) return vertices.error();
  frame.vertices_ = std::move(vertices).value();
  auto positions =
      positions_of(moved.vertex_positions(), float32, frame.vertices_.size(), "moved.vertex_positions");
  if (!positions) return positions.error();
  frame.vertex_positions_ = std::move(positions).value();
  return frame;
}

Frame WireFrame::frame() const {
  if (whole_) return Frame(view(positions_));
  Frame frame;
  frame.bodies = bodies_;
  frame.poses = poses_;
  frame.vertices = vertices_;
  frame.vertex_positions = view(vertex_positions_);
  return frame;
}

}  // namespace warmfront::client
