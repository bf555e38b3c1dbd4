// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/patches.h"

#include <algorithm>
#include <unordered_map>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/adjacency.h"
#include "engine/scene/scene_edges.h"

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
std::uint32_t across(const Scene& scene, std::uint32_t f, EdgeId e) {
  const auto faces = faces_along(scene, e);
  if (faces.size() != 2) return f;
  const std::uint32_t g = faces[0] == f ? faces[1] : faces[0];
  const Edge& edge = ends_of(scene, e);
  return runs_along(scene.faces()[f], edge) != runs_along(scene.faces()[g], edge) ? g : f;
}

class Grower {
 public:
  explicit Grower(const Scene& scene) : scene_(scene), vertex_seen_(scene.vertex_count(), 0) {
    patches_.of_face.assign(scene.face_count(), Patches::kNone);
    face_seen_.assign(scene.face_count(), 0);
    patches_.faces.begin = {0};
    patches_.contours.begin = {0};
  }

  // Large rings first, then smaller ones in the gaps.
  Patches run(int rings, StopSignal stop) {
    PacedStop paced(stop, 64);
    for (; rings >= 2; --rings) {
      for (std::uint32_t v = 0; v < scene_.vertex_count(); ++v) {
        paced.check();
        if (gather(v, rings) && is_joined() && find_contour()) keep();
      }
    }
    return std::move(patches_);
  }

 private:
  bool is_free(std::uint32_t face) const { return patches_.of_face[face] == Patches::kNone; }

  // Collects the faces around all vertices within rings - 1 edges of `centre` in piece_; false when one is
  // taken.
  bool gather(std::uint32_t centre, int rings) {
    piece_.clear();
    vertices_.assign(1, centre);
    ++stamp_;
    vertex_seen_[centre] = stamp_;
    std::size_t ring_begin = 0;
    for (int ring = 0; ring < rings; ++ring) {
      const std::size_t ring_end = vertices_.size();
      for (; ring_begin < ring_end; ++ring_begin) {
        for (const std::uint32_t f : scene_.vertex_faces()[vertices_[ring_begin]]) {
          // A face that repeats an index has no normal, so it is in no patch.
          if (!is_free(f) || repeats_vertex(scene_.faces()[f]) || piece_.size() > kMostFaces) return false;
          if (face_seen_[f] == stamp_) continue;
          face_seen_[f] = stamp_;
          piece_.push_back(f);
          for (const std::uint32_t v : scene_.faces()[f]) {
            if (vertex_seen_[v] == stamp_) continue;
            vertex_seen_[v] = stamp_;
            vertices_.push_back(v);
          }
        }
      }
    }
    return piece_.size() >= 4;  // smaller pieces have few non-adjacent pairs
  }

  // Are all faces of the piece connected through its manifold, consistently oriented edges?
  bool is_joined() {
    members_ = piece_;
    std::sort(members_.begin(), members_.end());
    queue_.assign(1, piece_[0]);
    ++stamp_;
    face_seen_[piece_[0]] = stamp_;
    for (std::size_t next = 0; next < queue_.size(); ++next) {
      for (const EdgeId e : sides_of(scene_, queue_[next])) {
        const std::uint32_t g = across(scene_, queue_[next], e);
        if (face_seen_[g] == stamp_ || !std::binary_search(members_.begin(), members_.end(), g)) continue;
        face_seen_[g] = stamp_;
        queue_.push_back(g);
      }
    }
    return queue_.size() == piece_.size();
  }

  // Walks the piece's boundary. Two faces of the piece that share an edge are joined only if across() says
  // so, and an edge with more than two faces joins none: then both sides count as boundary and the walk finds
  // no single contour.
  bool find_contour() {
    std::unordered_map<std::uint32_t, std::uint32_t> next;
    for (const std::uint32_t f : piece_) {
      const Face& face = scene_.faces()[f];
      for (int side = 0; side < 3; ++side) {
        const std::uint32_t g = across(scene_, f, side_of(scene_, f, side));
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

  // A hub vertex would give a ring of unbounded size.
  static constexpr std::size_t kMostFaces = 256;

  const Scene& scene_;
  Patches patches_;
  std::uint32_t stamp_ = 0;
  std::vector<std::uint32_t> vertex_seen_;  // stamp of the last piece that met the vertex
  std::vector<std::uint32_t> face_seen_;
  std::vector<std::uint32_t> piece_;
  std::vector<std::uint32_t> vertices_;
  std::vector<std::uint32_t> members_;  // piece_, sorted
  std::vector<std::uint32_t> queue_;
  std::vector<std::uint32_t> contour_;
};

}  // namespace

Patches find_patches(const Scene& scene, int rings, StopSignal stop) {
  return Grower(scene).run(rings, stop);
}

Patches join_patches(std::span<const PatchesSlice> slices, StopSignal stop) {
  Patches result;
  PacedStop paced(stop);
  const auto append_row = [](Csr& to, std::span<const std::uint32_t> row, std::uint32_t shift) {
    if (to.begin.empty()) to.begin.push_back(0);
    for (const std::uint32_t number : row) to.items.push_back(number + shift);
    to.begin.push_back(static_cast<std::uint32_t>(to.items.size()));
  };
  std::size_t faces = 0;
  for (const PatchesSlice& slice : slices) faces += slice.end_face - slice.first_face;
  reserve(result.of_face, faces, stop);
  for (const auto& [patches, first_face, end_face, shift] : slices) {
    if (patches->count() == 0) {
      lengthen(result.of_face, result.of_face.size() + end_face - first_face, Patches::kNone, stop);
      continue;
    }
    std::vector<std::uint32_t> renumbered(patches->count(), Patches::kNone);
    for (std::uint32_t f = first_face; f < end_face; ++f) {
      paced.check();
      const std::uint32_t old = patches->of_face[f];
      if (old != Patches::kNone && renumbered[old] == Patches::kNone) {
        renumbered[old] = static_cast<std::uint32_t>(result.count());
        append_row(result.faces, patches->faces[old], shift.face);
        append_row(result.contours, patches->contours[old], shift.vertex);
      }
      result.of_face.push_back(old == Patches::kNone ? old : renumbered[old]);
    }
  }
  return result;
}

}  // namespace warmfront
