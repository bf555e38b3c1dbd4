// SPDX-License-Identifier: Apache-2.0
#include "client/python/native/given_frame.h"

#include <algorithm>
#include <span>
#include <variant>

#include "client/python/native/errors.h"
#include "client/python/native/reading.h"

namespace warmfront::python {
namespace py = pybind11;
namespace {

// Of v1.MovedParts.
enum Part : std::size_t {
  kBodies = 1,
  kBodyPositions,
  kPoseBodies,
  kPoses,
  kVertices,
  kVertexPositions,
  kParts
};

Positions numbers(const py::buffer_info& info, std::size_t first, std::size_t count, bool float32) {
  if (float32) return std::span(static_cast<const float*>(info.ptr) + first, count);
  return std::span(static_cast<const double*>(info.ptr) + first, count);
}

std::size_t bytes_in(const py::buffer_info& info) {
  return static_cast<std::size_t>(info.size * info.itemsize);
}

std::vector<std::uint32_t> indices_in(const std::vector<py::buffer_info>& buffers) {
  std::vector<std::uint32_t> indices;
  for (const py::buffer_info& info : buffers) {
    const auto* first = static_cast<const std::uint32_t*>(info.ptr);
    indices.insert(indices.end(), first, first + bytes_in(info) / sizeof(std::uint32_t));
  }
  return indices;
}

}  // namespace

GivenFrame::GivenFrame(const py::object& positions, const py::object& parts, bool float32,
                       const Scene& scene) {
  if (!positions.is_none()) {
    all_ = py::reinterpret_borrow<py::buffer>(positions).request();
    frame_.positions = python::positions_of(all_);
    bytes_ = bytes_in(all_);
    return;
  }
  if (parts.is_none()) return;
  held_.resize(kParts);
  for (const py::handle part : parts) {
    const auto pair = py::reinterpret_borrow<py::tuple>(part);
    std::vector<py::buffer_info>& buffers = held_.at(pair[0].cast<std::size_t>());
    for (const py::handle buffer : pair[1]) {
      buffers.push_back(py::reinterpret_borrow<py::buffer>(buffer).request());
      bytes_ += bytes_in(buffers.back());
    }
  }
  body_numbers_ = indices_in(held_[kBodies]);
  take_bodies(held_[kBodyPositions], float32, scene);
  pose_numbers_ = indices_in(held_[kPoseBodies]);
  take_poses(held_[kPoses], float32, scene);
  vertices_ = indices_in(held_[kVertices]);
  frame_.bodies = bodies_;
  frame_.poses = poses_;
  frame_.vertices = vertices_;
  if (!vertices_.empty())
    frame_.vertex_positions = numbers(held_[kVertexPositions].at(0), 0, 3 * vertices_.size(), float32);
}

void GivenFrame::take_bodies(const std::vector<py::buffer_info>& rows, bool float32, const Scene& scene) {
  const std::size_t number = float32 ? sizeof(float) : sizeof(double);
  auto buffer = rows.begin();
  std::size_t at = 0;  // numbers of it that are taken
  for (const std::uint32_t body : body_numbers_) {
    const std::size_t count = std::size_t{3} * scene.bodies()[body].vertex_count;
    if (count == 0) {
      bodies_.push_back(
          {body, float32 ? Positions(std::span<const float>()) : Positions(std::span<const double>())});
      continue;
    }
    if (buffer != rows.end() && at * number == bytes_in(*buffer)) {
      ++buffer;
      at = 0;
    }
    if (buffer == rows.end() || (at + count) * number > bytes_in(*buffer))
      throw raised(invalid_argument("moved.body_positions: fewer than the bodies named have"));
    bodies_.push_back({body, numbers(*buffer, at, count, float32)});
    at += count;
  }
}

void GivenFrame::take_poses(const std::vector<py::buffer_info>& matrices, bool float32, const Scene& scene) {
  if (matrices.empty()) return;
  if (pose_numbers_.empty()) {
    for (std::uint32_t b = 0; b < scene.bodies().size(); ++b) {
      if (scene.bodies()[b].kind == BodyKind::kRigid) pose_numbers_.push_back(b);
    }
  }
  for (std::size_t i = 0; i < pose_numbers_.size(); ++i) {
    BodyPose& pose = poses_.emplace_back(BodyPose{pose_numbers_[i], {}});
    std::visit([&](auto values) { std::ranges::copy(values, pose.pose.matrix.begin()); },
               numbers(matrices[0], 12 * i, 12, float32));
  }
}

}  // namespace warmfront::python
