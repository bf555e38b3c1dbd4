// SPDX-License-Identifier: Apache-2.0
// Minimal readers for the data's own files (binary PLY meshes, PC2 caches), so that engine tests need no
// client code. They trust their input; client/io holds the readers that do not.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

namespace warmfront::testing {

struct RealMesh {
  std::vector<float> positions;
  std::vector<std::array<std::int32_t, 3>> faces;
};

RealMesh read_mesh(const std::filesystem::path& ply);

/// A folder with mesh.ply and frames.pc2.
class FrameSequence {
 public:
  explicit FrameSequence(const std::filesystem::path& folder);
  const RealMesh& mesh() const { return mesh_; }
  int count() const { return count_; }
  std::vector<float> read(int frame);

 private:
  RealMesh mesh_;
  std::ifstream cache_;
  int count_ = 0;
};

}  // namespace warmfront::testing
