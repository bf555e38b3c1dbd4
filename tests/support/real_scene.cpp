// SPDX-License-Identifier: Apache-2.0
#include "tests/support/real_scene.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>
#include <string>

namespace warmfront::testing {
namespace {

template <class T>
void swap_bytes(T& value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, 4);
  bits = __builtin_bswap32(bits);
  std::memcpy(&value, &bits, 4);
}

}  // namespace

RealMesh read_mesh(const std::filesystem::path& ply) {
  std::ifstream in(ply, std::ios::binary);
  std::string line;
  std::size_t vertices = 0;
  std::size_t faces = 0;
  std::streamsize skip = 0;  // bytes of colour behind each vertex
  bool big = false;
  while (std::getline(in, line) && line != "end_header") {
    if (line.starts_with("format binary_big_endian")) big = true;
    if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
    if (line.starts_with("element face ")) faces = std::stoul(line.substr(13));
    if (line.starts_with("property uchar ")) ++skip;
  }
  RealMesh mesh;
  mesh.positions.resize(3 * vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    in.read(reinterpret_cast<char*>(mesh.positions.data() + 3 * v), 12);
    in.ignore(skip);
  }
  mesh.faces.resize(faces);
  for (auto& face : mesh.faces) {
    in.ignore(1);
    in.read(reinterpret_cast<char*>(face.data()), 12);
  }
  if (!in) throw std::runtime_error("cannot read " + ply.string());
  if (big) {
    for (float& x : mesh.positions) swap_bytes(x);
    for (auto& face : mesh.faces) std::ranges::for_each(face, swap_bytes<std::int32_t>);
  }
  return mesh;
}

FrameSequence::FrameSequence(const std::filesystem::path& folder)
    : mesh_(read_mesh(folder / "mesh.ply")), cache_(folder / "frames.pc2", std::ios::binary) {
  cache_.seekg(28);
  cache_.read(reinterpret_cast<char*>(&count_), 4);
}

std::vector<float> FrameSequence::read(int frame) {
  std::vector<float> positions(mesh_.positions.size());
  const auto bytes = static_cast<std::streamoff>(4 * positions.size());
  cache_.seekg(32 + frame * bytes);
  cache_.read(reinterpret_cast<char*>(positions.data()), bytes);
  if (!cache_) throw std::runtime_error("cannot read frame " + std::to_string(frame));
  return positions;
}

}  // namespace warmfront::testing
