// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/ownership.h"

#include <algorithm>
#include <bit>
#include <unordered_map>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/adjacency.h"

namespace warmfront {
namespace {

constexpr std::uint32_t slot(std::uint32_t v) {
  return v & 255U;
}

template <class Bloom>
void insert(Bloom& bloom, const Face& face) {
  for (const std::uint32_t v : face) bloom[slot(v) >> 6] |= std::uint64_t{1} << (slot(v) & 63U);
}

template <class Bloom>
bool perhaps_contains(const Bloom& bloom, std::uint32_t v) {
  return (bloom[slot(v) >> 6] >> (slot(v) & 63U)) & 1U;
}

// What the set is of vertices whose numbers are `shift` more.
template <class Bloom>
void rotate(Bloom& bloom, std::uint32_t shift) {
  const Bloom from = bloom;
  const std::uint32_t words = slot(shift) >> 6;
  const std::uint32_t bits = shift & 63U;
  for (std::uint32_t i = 0; i < 4; ++i) {
    bloom[(i + words) & 3U] =
        (from[i] << bits) | (bits != 0 ? from[(i + 3) & 3U] >> (64 - bits) : std::uint64_t{0});
  }
}

// The pairs of the given corners (bits 0-2) and sides (bits 3-5) of f with those of g.
std::uint32_t pairs_of(std::uint32_t f, std::uint32_t g) {
  const std::uint32_t edges_g = (g >> 3) & 7U;
  std::uint32_t mask = (f & 7U) | ((g & 7U) << 3);
  for (int i = 0; i < 3; ++i) {
    if (f & (8U << i)) mask |= edges_g << (6 + 3 * i);
  }
  return mask;
}

// Is the face the first of these that is not adjacent to what it is paired with?
template <class IsAdjacent>
bool is_first(std::uint32_t face, std::span<const std::uint32_t> faces, IsAdjacent&& is_adjacent) {
  for (const std::uint32_t g : faces) {
    if (g == face) return true;
    if (!is_adjacent(g)) return false;
  }
  return false;
}

}  // namespace

void Ownership::make_room(std::uint32_t face_count, StopSignal stop) {
  make_room_for_runs(records_, face_count, stop);
  make_room_for_runs(signatures_, face_count, stop);
}

void Ownership::splice(std::span<const Slice> slices, std::span<const Run> runs,
                       std::uint32_t face_count) noexcept {
  move_runs(records_, runs, face_count);
  move_runs(signatures_, runs, face_count);
  std::size_t to = 0;
  for (const auto& [ownership, first_face, end_face, shift, changed] : slices) {
    const std::size_t end = to + end_face - first_face;
    if (changed != nullptr) {
      take(*changed, shift);
      to = end;
      continue;
    }
    if (ownership != nullptr) {
      std::copy_n(ownership->records_.begin() + first_face, end - to,
                  records_.begin() + static_cast<std::ptrdiff_t>(to));
      std::copy_n(ownership->signatures_.begin() + first_face, end - to,
                  signatures_.begin() + static_cast<std::ptrdiff_t>(to));
    }
    if (shift.any()) {
      for (std::size_t f = to; f < end; ++f) Ownership::shift(records_[f], signatures_[f], shift);
    }
    to = end;
  }
}

// What stays was moved to its place.
void Ownership::take(const Changed& changed, const NumberShift& shift) noexcept {
  const LocalChange& change = changed.change_;
  const std::uint32_t first_before = changed.part_.first_face;
  const std::uint32_t vertex = shift.vertex - changed.part_.features.first_vertex;  // all modulo 2^32
  const bool in_place =
      shift.face == first_before &&
      std::ranges::all_of(change.face_runs, [](const Run& run) { return run.from == run.to; });
  for (const Run& run : change.face_runs) {
    if (in_place && vertex == 0) break;
    // Most name faces of the same run.
    const auto from = first_before + static_cast<std::uint32_t>(run.from);
    const auto to = shift.face + static_cast<std::uint32_t>(run.to);
    for (std::size_t f = to; f < to + run.count; ++f) {
      if (vertex != 0) Ownership::shift(records_[f], signatures_[f], {vertex, 0, 0});
      for (Face* first : {&records_[f].first_of_vertex, &records_[f].first_of_edge}) {
        for (std::uint32_t& g : *first)
          g = g - from < run.count ? g - from + to : change.face_of[g - first_before] + shift.face;
      }
    }
  }
  for (std::size_t i = 0; i < changed.faces_.size(); ++i) {
    const std::size_t f = shift.face + std::size_t{changed.faces_[i]};
    records_[f] = changed.records_[i];
    signatures_[f] = changed.signatures_[i];
    if (shift.any()) Ownership::shift(records_[f], signatures_[f], shift);
  }
}

void Ownership::shift(Record& record, std::uint64_t& signature, const NumberShift& by) {
  for (int i = 0; i < 3; ++i) {
    record.vertices[i] += by.vertex;
    record.first_of_vertex[i] += by.face;
    record.first_of_edge[i] += by.face;
  }
  rotate(record.vertex_ring, by.vertex);
  rotate(record.edge_ring, by.vertex);
  signature = std::rotl(signature, static_cast<int>(by.vertex & 63U));
}

// Makes records, face by face.
class Ownership::Recorder {
 public:
  explicit Recorder(const Scene& scene) : scene_(scene) {}

  void make(std::uint32_t f, Record& record, std::uint64_t& signature) {
    record.vertices = scene_.faces()[f];
    for (const std::uint32_t v : record.vertices) signature |= std::uint64_t{1} << (v & 63U);
    record.first_bits = 0;
    record.vertex_ring = {};
    record.edge_ring = {};
    for (int i = 0; i < 3; ++i) {
      const auto vertex_faces = scene_.vertex_faces()[record.vertices[i]];
      const EdgeId edge = side_of(scene_, f, i);
      const auto edge_faces = faces_along(scene_, edge);
      record.first_of_vertex[i] = vertex_faces.front();
      record.first_of_edge[i] = edge_faces.front();
      const auto is_new = [i](const auto& three) {
        return std::find(three.begin(), three.begin() + i, three[i]) == three.begin() + i;
      };
      if (is_new(record.vertices)) record.first_bits |= (vertex_faces.front() == f ? 0x41U : 0x40U) << i;
      if (is_new(scene_.face_edges()[f]))
        record.first_bits |= (edge_faces.front() == f ? 0x208U : 0x200U) << i;
      add_ring(record.vertex_ring, around_, record.vertices[i], vertex_faces);
      add_ring(record.edge_ring, along_, edge, edge_faces);
    }
  }

 private:
  // Many faces around one vertex or along one edge share the ring there: compute it once.
  static constexpr std::size_t kMany = 64;
  template <class Feature>
  using Rings = std::unordered_map<Feature, Bloom>;

  void insert_all(Bloom& ring, std::span<const std::uint32_t> faces) const {
    for (const std::uint32_t g : faces) insert(ring, scene_.faces()[g]);
  }
  template <class Feature>
  void add_ring(Bloom& ring, Rings<Feature>& known, Feature feature,
                std::span<const std::uint32_t> faces) const {
    if (faces.size() <= kMany) return insert_all(ring, faces);
    const auto [of_feature, is_new] = known.try_emplace(feature);
    if (is_new) insert_all(of_feature->second, faces);
    for (std::size_t word = 0; word < ring.size(); ++word) ring[word] |= of_feature->second[word];
  }

  const Scene& scene_;
  Rings<std::uint32_t> around_;
  Rings<EdgeId> along_;
};

void Ownership::extend(StopSignal stop) {
  constexpr std::size_t kPiece = 4096;
  const Scene& scene = *scene_;
  const std::size_t first = records_.size();
  lengthen(records_, scene.face_count(), Record{}, stop);
  lengthen(signatures_, scene.face_count(), std::uint64_t{0}, stop);
  const auto make = [&](std::size_t begin, std::size_t end) {
    PacedStop paced(stop, 256);
    Recorder recorder(scene);
    for (std::size_t f = begin; f < end; ++f) {
      paced.check();
      recorder.make(static_cast<std::uint32_t>(f), records_[f], signatures_[f]);
    }
  };
  for_pieces(first, scene.face_count(), kPiece, stop, make);
}

// A face of which no vertex is one of what went or came has the faces around it and along it that it had.
Ownership::Ownership(const Scene& scene, const Ownership& before, const MeshRange& part,
                     const LocalChange& change, StopSignal stop)
    : scene_(&scene) {
  PacedStop paced(stop, 256);
  Recorder recorder(scene);
  reserve(records_, scene.face_count(), stop);
  reserve(signatures_, scene.face_count(), stop);
  const NumberShift to_body{0 - part.features.first_vertex, 0, 0};
  std::vector<std::uint8_t> at;
  lengthen(at, scene.vertex_count(), std::uint8_t{0}, stop);
  for (const std::uint32_t v : change.at) at[v] = 1;
  const auto is_as_it_was = [&](const Face& face) { return (at[face[0]] | at[face[1]] | at[face[2]]) == 0; };
  for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
    paced.check();
    if (!is_as_it_was(scene.faces()[f])) {
      records_.emplace_back();
      signatures_.push_back(0);
      recorder.make(f, records_[f], signatures_[f]);
      continue;
    }
    const std::uint32_t old = part.first_face + change.face_before[f];
    records_.push_back(before.records_[old]);
    signatures_.push_back(before.signatures_[old]);
    if (to_body.any()) shift(records_[f], signatures_[f], to_body);
    for (Face* first : {&records_[f].first_of_vertex, &records_[f].first_of_edge}) {
      for (std::uint32_t& g : *first) g = change.face_of[g - part.first_face];
    }
  }
}

// Those of a vertex of what went or came.
Ownership::Changed::Changed(const Scene& scene, const MeshRange& part, const LocalChange& change,
                            StopSignal stop)
    : part_(part), change_(change) {
  PacedStop paced(stop, 256);
  std::vector<std::uint8_t> taken;
  lengthen(taken, scene.face_count(), std::uint8_t{0}, stop);
  Recorder recorder(scene);
  for (const std::uint32_t v : change.at) {
    for (const std::uint32_t f : scene.vertex_faces()[v]) {
      paced.check();
      if (std::exchange(taken[f], std::uint8_t{1}) != 0) continue;
      faces_.push_back(f);
      signatures_.push_back(0);
      recorder.make(f, records_.emplace_back(), signatures_.back());
    }
  }
}

void Ownership::truncate(std::uint32_t face_count) noexcept {
  records_.resize(std::min<std::size_t>(face_count, records_.size()));
  signatures_.resize(std::min<std::size_t>(face_count, signatures_.size()));
}

// An earlier face of a feature can be adjacent to the other side only when the sides are near each other in
// the mesh: around a vertex, when that face contains a vertex of the other; along edges, when the two edge
// rings share a vertex. The edge rings contain the faces' own vertices, which non-adjacent faces do not
// share; hash collisions only cost time.
bool Ownership::perhaps_near(const Record& f, const Record& g) const {
  for (int i = 0; i < 3; ++i) {
    if (perhaps_contains(f.vertex_ring, g.vertices[i]) || perhaps_contains(g.vertex_ring, f.vertices[i]))
      return true;
  }
  std::uint64_t common = 0;
  for (int word = 0; word < 4; ++word) common |= f.edge_ring[word] & g.edge_ring[word];
  return common != 0;
}

bool Ownership::are_adjacent(std::uint32_t f, std::uint32_t g) const {
  return perhaps_adjacent(f, g) && adjacent(scene_->faces()[f], scene_->faces()[g]);
}

Ownership::Candidates Ownership::candidates(std::uint32_t f, std::uint32_t g) const {
  const Record& rf = records_[f];
  const Record& rg = records_[g];
  // Where no earlier face matters, each feature's first face owns it.
  const std::uint32_t owned = pairs_of(rf.first_bits, rg.first_bits);
  return {owned, perhaps_near(rf, rg) ? pairs_of(rf.first_bits >> 6, rg.first_bits >> 6) & ~owned : 0};
}

std::uint32_t Ownership::owned_with_segment(Primitive p, EdgeId lone_edge) const {
  constexpr std::uint32_t kFirstEdges = 1U << 6;
  if (!is_face(p)) return kFirstEdges;
  const std::uint32_t f = face_number(p);
  const Edge& edge = ends_of(*scene_, lone_edge);
  std::uint32_t owned = 0;
  for (int k = 0; k < 2; ++k) {
    if (scene_->vertex_faces()[edge[k]].empty() && lone_edges_of(*scene_, edge[k]).front() == lone_edge)
      owned |= 8U << k;
  }
  for (int i = 0; i < 3; ++i) {
    const bool occurs_first = (records_[f].first_bits >> (9 + i) & 1U) != 0;
    const auto is_adjacent = [&](std::uint32_t g) { return adjacent(edge, scene_->faces()[g]); };
    if (occurs_first && is_first(f, faces_along(*scene_, side_of(*scene_, f, i)), is_adjacent))
      owned |= kFirstEdges << (3 * i);
  }
  return owned;
}

// A pair that is not a feature's first pair can own it only if the first pair is adjacent.
bool Ownership::owns(std::uint32_t f, std::uint32_t g, int bit) const {
  if (bit >= 3 && bit < 6) return owns(g, f, bit - 3);
  const Record& rf = records_[f];
  const Record& rg = records_[g];
  if (bit < 3) return perhaps_adjacent(rf.first_of_vertex[bit], g) && owns_vf(f, rf.vertices[bit], g);
  const int i = (bit - 6) / 3;
  const int j = (bit - 6) % 3;
  return perhaps_adjacent(rf.first_of_edge[i], rg.first_of_edge[j]) &&
         owns_ee(f, side_of(*scene_, f, i), g, side_of(*scene_, g, j));
}

bool Ownership::owns_edge_face(std::uint32_t f, int i, std::uint32_t g) const {
  if ((records_[f].first_bits >> (9 + i) & 1U) == 0)
    return false;  // the same side occurs earlier in the face
  return is_first(f, faces_along(*scene_, side_of(*scene_, f, i)),
                  [&](std::uint32_t h) { return are_adjacent(h, g); });
}

bool Ownership::owns_vf(std::uint32_t owner, std::uint32_t v, std::uint32_t face) const {
  return is_first(owner, scene_->vertex_faces()[v], [&](std::uint32_t g) { return are_adjacent(g, face); });
}

bool Ownership::owns_ee(std::uint32_t f, EdgeId e1, std::uint32_t g, EdgeId e2) const {
  if (e1 > e2) {
    std::swap(e1, e2);
    std::swap(f, g);
  }
  for (const std::uint32_t first : faces_along(*scene_, e1)) {
    for (const std::uint32_t second : faces_along(*scene_, e2)) {
      if (first == f && second == g) return true;
      if (!are_adjacent(first, second)) return false;
    }
  }
  return false;
}

}  // namespace warmfront
