// SPDX-License-Identifier: Apache-2.0
// Frames from bytes. Thread safety as stated in the header.
#include "server/session/frame_buffer.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace warmfront::server {
namespace {

constexpr std::array kNames{"bodies", "body_positions", "pose_bodies",
                            "poses",  "vertices",       "vertex_positions"};

std::string bytes_of(std::size_t bytes) {
  return std::to_string(bytes) + " bytes";
}

}  // namespace

FrameBuffer::FrameBuffer(Dtype dtype, const Scene& scene)
    : dtype_(dtype), positions_(dtype, scene.vertex_count()) {
  const std::size_t number = size_of(dtype);
  const std::size_t vertices = scene.vertex_count();
  const std::size_t bodies = scene.bodies().size();
  most_ = {4 * bodies,           3 * number * vertices, 4 * bodies,
           12 * number * bodies, 4 * vertices,          3 * number * vertices};
  // Whoever names each vertex and each body once is understood, though all positions would take less.
  expected_ = positions_.expected_bytes() + 4 * vertices + (8 + 12 * number) * bodies;
}

Status FrameBuffer::fail(std::string message) {
  if (!error_) error_ = invalid_argument(std::move(message));
  return *error_;
}

Status FrameBuffer::append(std::string_view positions) {
  if (positions.empty()) return {};
  whole_ = true;
  return positions_.append(positions);
}

Status FrameBuffer::append(std::span<const std::string_view> positions) {
  if (positions.empty()) return {};
  whole_ = true;
  return positions_.append(positions);
}

Status FrameBuffer::append(const MovedPiece& piece) {
  moved_ = true;
  const std::array pieces{piece.bodies, piece.body_positions, piece.pose_bodies,
                          piece.poses,  piece.vertices,       piece.vertex_positions};
  for (std::size_t field = 0; field < kCount; ++field) {
    if (error_) return *error_;
    if (pieces[field].size() > most_[field] - bytes_[field].size())
      return fail(std::string("moved.") + kNames[field] + ": at least " +
                  bytes_of(bytes_[field].size() + pieces[field].size()) +
                  ", more than the scene could use, which is " + bytes_of(most_[field]));
    bytes_[field] += pieces[field];
    received_ += pieces[field].size();
  }
  if (received_ > expected_)
    return fail("moved: at least " + bytes_of(received_) +
                ", more than all vertices and bodies take, each named once: " + bytes_of(expected_) +
                "; send positions instead");
  return {};
}

std::vector<std::uint32_t> FrameBuffer::indices(Field field) const {
  std::vector<std::uint32_t> values(bytes_[field].size() / 4);
  if (!values.empty()) std::memcpy(values.data(), bytes_[field].data(), 4 * values.size());
  return values;
}

// std::string's memory is aligned for any number.
Positions FrameBuffer::numbers(Field field, std::size_t first, std::size_t count) const {
  const char* data = bytes_[field].data();
  if (dtype_ == Dtype::kFloat32) return std::span(reinterpret_cast<const float*>(data) + first, count);
  return std::span(reinterpret_cast<const double*>(data) + first, count);
}

Status FrameBuffer::complete(const Scene& scene) {
  if (error_) return *error_;
  if (!moved_) return positions_.complete();
  if (whole_) return fail("moved: the frame gives all positions as well; give either");
  for (const Field field : {kBodies, kPoseBodies, kVertices}) {
    if (bytes_[field].size() % 4 != 0)
      return fail(std::string("moved.") + kNames[field] + ": " + bytes_of(bytes_[field].size()) +
                  " are no whole number of uint32");
  }
  if (Status status = split_bodies(scene); !status) return status;
  if (Status status = split_poses(scene); !status) return status;
  vertices_ = indices(kVertices);
  const std::size_t expected = 3 * size_of(dtype_) * vertices_.size();
  if (bytes_[kVertexPositions].size() != expected)
    return fail("moved.vertex_positions: " + bytes_of(bytes_[kVertexPositions].size()) + ", but " +
                bytes_of(expected) + " are expected for " + std::to_string(vertices_.size()) + " vertices");
  return {};
}

Status FrameBuffer::split_bodies(const Scene& scene) {
  bodies_.clear();
  std::size_t first = 0;
  bool cut = false;  // there may be more bodies
  for (const std::uint32_t body : indices(kBodies)) {
    if (body >= scene.bodies().size())
      return fail("moved.bodies: body " + std::to_string(body) + " is not in [0, " +
                  std::to_string(scene.bodies().size()) + ")");
    const std::size_t count = std::size_t{3} * scene.bodies()[body].vertex_count;
    if ((first + count) * size_of(dtype_) > bytes_[kBodyPositions].size()) {
      first += count;
      cut = true;
      break;
    }
    bodies_.push_back({body, numbers(kBodyPositions, first, count)});
    first += count;
  }
  if (first * size_of(dtype_) != bytes_[kBodyPositions].size())
    return fail("moved.body_positions: " + bytes_of(bytes_[kBodyPositions].size()) + ", but " +
                bytes_of(first * size_of(dtype_)) + (cut ? " or more" : "") +
                " are expected for the bodies named");
  return {};
}

Status FrameBuffer::split_poses(const Scene& scene) {
  poses_.clear();
  std::vector<std::uint32_t> bodies = indices(kPoseBodies);
  if (bodies.empty() && !bytes_[kPoses].empty()) {
    for (std::uint32_t b = 0; b < scene.bodies().size(); ++b) {
      if (scene.bodies()[b].kind == BodyKind::kRigid) bodies.push_back(b);
    }
  }
  const std::size_t expected = 12 * size_of(dtype_) * bodies.size();
  if (bytes_[kPoses].size() != expected)
    return fail("moved.poses: " + bytes_of(bytes_[kPoses].size()) + ", but " + bytes_of(expected) +
                " are expected for " + std::to_string(bodies.size()) + " rigid bodies");
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    BodyPose& pose = poses_.emplace_back(BodyPose{bodies[i], {}});
    std::visit([&](auto values) { std::ranges::copy(values, pose.pose.matrix.begin()); },
               numbers(kPoses, 12 * i, 12));
  }
  return {};
}

Frame FrameBuffer::view() const {
  if (!moved_) return Frame(positions_.view());
  Frame frame;
  frame.bodies = bodies_;
  frame.poses = poses_;
  frame.vertices = vertices_;
  frame.vertex_positions = numbers(kVertexPositions, 0, 3 * vertices_.size());
  return frame;
}

void FrameBuffer::add_to(StateDigest& digest) const {
  digest.add(std::uint64_t{moved_});
  if (!moved_) return digest.add(positions_.hash());
  for (const std::string& field : bytes_) digest.add(field);
}

std::size_t FrameBuffer::memory_bytes() const {
  std::size_t bytes = whole_ ? positions_.expected_bytes() : 0;
  for (const std::string& field : bytes_) bytes += field.capacity();
  return bytes + vertices_.capacity() * sizeof(std::uint32_t) + bodies_.capacity() * sizeof(BodyPositions) +
         poses_.capacity() * sizeof(BodyPose);
}

bool operator==(const FrameBuffer& a, const FrameBuffer& b) {
  if (a.error_ || b.error_) return false;  // there was more than is kept
  return a.moved_ == b.moved_ && a.bytes_ == b.bytes_ && a.positions_ == b.positions_;
}

}  // namespace warmfront::server
