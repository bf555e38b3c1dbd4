// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/patches.h"

#include <algorithm>
#include <unordered_map>

namespace warmfront {
namespace {

// Does the face run from edge[0] to edge[1]?
bool runs_along(const Face& face, const Edge& edge) {
  for (int i = 0; i < 3; ++i) {
    if (face[i] == edge[0]) return face[(i + 1) % 3] == edge[1];
  }
  return false;
}

// The face on the other side of edge `e` of `f` when the edge is manifold and both faces are oriented alike;
// else f.
std::uint32_t across(const Scene& scene, std::uint32_t f, std::uint32_t e) {
  const auto faces = scene.edge_faces()[e];
  if (faces.size() != 2) return f;
  const std::uint32_t g = faces[0] == f ? faces[1] : faces[0];
  const Edge& edge = scene.edges()[e];
  return runs_along(scene.faces()[f], edge) != runs_along(scene.faces()[g], edge) ? g : f;
}

class Grower {
 public:
  Grower(const Scene& scene, std::uint32_t max_faces) : scene_(scene), max_faces_(max_faces) {
    patches_.of_face.assign(scene.face_count(), Patches::kNone);
    taken_.assign(scene.face_count(), false);
    patches_.faces.begin = {0};
    patches_.contours.begin = {0};
  }

  Patches run() {
    for (std::uint32_t seed = 0; seed < scene_.face_count(); ++seed) {
      if (taken_[seed]) continue;
      grow(seed);
      if (piece_.size() >= 4 && find_contour()) keep();
    }
    return std::move(patches_);
  }

 private:
  void grow(std::uint32_t seed) {
    piece_.assign(1, seed);
    taken_[seed] = true;
    for (std::size_t next = 0; next < piece_.size(); ++next) {
      for (const std::uint32_t e : scene_.face_edges()[piece_[next]]) {
        if (piece_.size() >= max_faces_) return;
        const std::uint32_t g = across(scene_, piece_[next], e);
        if (taken_[g]) continue;
        taken_[g] = true;
        piece_.push_back(g);
      }
    }
  }

  // Walks the piece's boundary. Two faces of the piece that share an edge are joined there only if across()
  // says so, and an edge with more than two faces joins none: then both sides count as boundary and the walk
  // finds no single contour.
  bool find_contour() {
    std::unordered_map<std::uint32_t, std::uint32_t> next;
    members_.clear();
    members_.insert(members_.end(), piece_.begin(), piece_.end());
    std::sort(members_.begin(), members_.end());
    for (const std::uint32_t f : piece_) {
      const Face& face = scene_.faces()[f];
      for (int side = 0; side < 3; ++side) {
        const std::uint32_t g = across(scene_, f, scene_.face_edges()[f][side]);
        if (g != f && std::binary_search(members_.begin(), members_.end(), g)) continue;
        if (!next.emplace(face[side], face[(side + 1) % 3]).second) return false;  // passes a vertex twice
      }
    }
    contour_.clear();
    if (next.empty()) return false;
    const std::uint32_t start = scene_.faces()[piece_[0]][0];
    std::uint32_t v = next.contains(start) ? start : std::min_element(next.begin(), next.end())->first;
    for (std::size_t i = 0; i < next.size(); ++i) {
      contour_.push_back(v);
      const auto found = next.find(v);
      if (found == next.end()) return false;
      v = found->second;
      if (v == contour_.front()) break;
    }
    return contour_.size() == next.size() && v == contour_.front();
  }

  void keep() {
    const auto id = static_cast<std::uint32_t>(patches_.count());
    for (const std::uint32_t f : piece_) patches_.of_face[f] = id;
    append(patches_.faces, piece_);
    append(patches_.contours, contour_);
  }

  static void append(Csr& csr, const std::vector<std::uint32_t>& row) {
    csr.items.insert(csr.items.end(), row.begin(), row.end());
    csr.begin.push_back(static_cast<std::uint32_t>(csr.items.size()));
  }

  const Scene& scene_;
  const std::uint32_t max_faces_;
  Patches patches_;
  std::vector<bool> taken_;
  std::vector<std::uint32_t> piece_;
  std::vector<std::uint32_t> members_;
  std::vector<std::uint32_t> contour_;
};

}  // namespace

Patches find_patches(const Scene& scene, std::uint32_t max_faces) {
  return Grower(scene, max_faces).run();
}

}  // namespace warmfront
