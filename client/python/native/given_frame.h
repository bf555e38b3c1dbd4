// SPDX-License-Identifier: Apache-2.0
// A frame as Python gives it, in the engine's words. With the interpreter's lock held.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/frame.h"
#include "engine/scene.h"

namespace warmfront::python {

/// A frame as Python gives it: all positions, or parts by their numbers in v1.MovedParts, each as buffers
/// that follow one another. Looks at their memory, which must not be resized.
class GivenFrame {
 public:
  /// `positions`: an array, or None. `parts`: a list of (number, list of buffers). Throws Raised where they
  /// do not fit the scene.
  GivenFrame(const pybind11::object& positions, const pybind11::object& parts, bool float32,
             const Scene& scene);
  GivenFrame(const GivenFrame&) = delete;
  GivenFrame& operator=(const GivenFrame&) = delete;

  const Frame& frame() const { return frame_; }
  std::size_t bytes() const { return bytes_; }

 private:
  void take_bodies(const std::vector<pybind11::buffer_info>& rows, bool float32, const Scene& scene);
  void take_poses(const std::vector<pybind11::buffer_info>& matrices, bool float32, const Scene& scene);

  pybind11::buffer_info all_;
  std::vector<std::vector<pybind11::buffer_info>> held_;  // parts, by number
  std::vector<std::uint32_t> body_numbers_;
  std::vector<std::uint32_t> pose_numbers_;
  std::vector<BodyPositions> bodies_;
  std::vector<BodyPose> poses_;
  std::vector<std::uint32_t> vertices_;
  Frame frame_;
  std::size_t bytes_ = 0;
};

}  // namespace warmfront::python
