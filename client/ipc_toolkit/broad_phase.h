// SPDX-License-Identifier: Apache-2.0
// Warmfront as a broad phase of IPC Toolkit: give it wherever one of that library's methods is taken. Needs
// its headers, and C++20. One thread at a time builds; candidates may then be asked for by several.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <ipc/broad_phase/broad_phase.hpp>
#include <ipc/broad_phase/default_broad_phase.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client/ipc_toolkit/mesh_candidates.h"

namespace warmfront::ipc_toolkit {

/// Candidates by a collider that stays warm from one build() to the next of the same elements, whatever the
/// positions: keep one object for a whole simulation. No pair that comes within twice the inflation radius is
/// missing; of those whose boxes overlap, others are left out. Candidates are listed in a fixed order, the
/// same for any number of threads. Which questions are IPC Toolkit's own method's is said in README.md.
///
/// Throws std::invalid_argument for coordinates that are not finite, for indices out of range, and for
/// patches of another number of vertices than is built.
class BroadPhase : public ::ipc::BroadPhase {
 public:
  /// `threads`: 0, one per core. `patches`: a number a vertex, 0 for none. Pairs of which all vertices have
  /// the same number are left out by the search itself, as ipc::make_vertex_patches_filter() leaves them out
  /// after it. Only meshes of so many vertices can be built then.
  explicit BroadPhase(int threads = 0, std::vector<std::uint32_t> patches = {})
      : workers_(std::make_shared<Workers>(threads)),
        patches_(std::move(patches)),
        other_(::ipc::make_default_broad_phase()) {}

  std::string name() const override { return "Warmfront"; }

  void build(Eigen::ConstRef<Eigen::MatrixXd> vertices, Eigen::ConstRef<Eigen::MatrixXi> edges,
             Eigen::ConstRef<Eigen::MatrixXi> faces, const double inflation_radius = 0) override {
    vertices_t0_ = vertices;
    vertices_t1_.resize(0, vertices.cols());
    begin(edges, faces, inflation_radius);
  }
  void build(Eigen::ConstRef<Eigen::MatrixXd> vertices_t0, Eigen::ConstRef<Eigen::MatrixXd> vertices_t1,
             Eigen::ConstRef<Eigen::MatrixXi> edges, Eigen::ConstRef<Eigen::MatrixXi> faces,
             const double inflation_radius = 0) override {
    vertices_t0_ = vertices_t0;
    vertices_t1_ = vertices_t1;
    begin(edges, faces, inflation_radius);
  }
  void build(const ::ipc::AABBs& vertex_boxes, Eigen::ConstRef<Eigen::MatrixXi> edges,
             Eigen::ConstRef<Eigen::MatrixXi> faces, const std::uint8_t dimension) override {
    clear();
    dim = dimension;
    other_->build(vertex_boxes, edges, faces, dimension);
    other_is_built_ = true;
  }

  /// Forgets what was built; colliders stay, and stay warm.
  void clear() override {
    ::ipc::BroadPhase::clear();
    current_ = nullptr;
    other_is_built_ = false;
  }

  void detect_vertex_vertex_candidates(std::vector<::ipc::VertexVertexCandidate>& candidates) const override {
    const std::lock_guard lock(mutex_);
    if (!answers()) return other().detect_vertex_vertex_candidates(candidates);
    current_->mesh->vertex_vertex([&](std::int32_t a, std::int32_t b) {
      if (can_vertices_collide(a, b)) candidates.emplace_back(a, b);
    });
  }
  void detect_edge_vertex_candidates(std::vector<::ipc::EdgeVertexCandidate>& candidates) const override {
    const std::lock_guard lock(mutex_);
    if (!answers()) return other().detect_edge_vertex_candidates(candidates);
    current_->mesh->edge_vertex([&](std::int32_t e, std::int32_t v) {
      if (can_collide(edge(e), std::array{v})) candidates.emplace_back(e, v);
    });
  }
  void detect_edge_edge_candidates(std::vector<::ipc::EdgeEdgeCandidate>& candidates) const override {
    const std::lock_guard lock(mutex_);
    if (!answers()) return other().detect_edge_edge_candidates(candidates);
    current_->mesh->edge_edge([&](std::int32_t a, std::int32_t b) {
      if (can_collide(edge(a), edge(b))) candidates.emplace_back(a, b);
    });
  }
  void detect_face_vertex_candidates(std::vector<::ipc::FaceVertexCandidate>& candidates) const override {
    const std::lock_guard lock(mutex_);
    if (!answers()) return other().detect_face_vertex_candidates(candidates);
    current_->mesh->face_vertex([&](std::int32_t f, std::int32_t v) {
      if (can_collide(face(f), std::array{v})) candidates.emplace_back(f, v);
    });
  }
  void detect_edge_face_candidates(std::vector<::ipc::EdgeFaceCandidate>& candidates) const override {
    const std::lock_guard lock(mutex_);
    if (!answers() || !current_->mesh->mesh().patches.empty())
      return other().detect_edge_face_candidates(candidates);
    current_->mesh->edge_face([&](std::int32_t e, std::int32_t f) {
      if (can_collide(edge(e), face(f))) candidates.emplace_back(e, f);
    });
  }
  void detect_face_face_candidates(std::vector<::ipc::FaceFaceCandidate>& candidates) const override {
    const std::lock_guard lock(mutex_);
    other().detect_face_face_candidates(candidates);
  }

 private:
  /// Elements that were built before. A simulation has one mesh, and up to two more of its codimensional
  /// parts.
  struct Elements {
    Eigen::Index vertex_count;
    Eigen::MatrixXi edges;
    Eigen::MatrixXi faces;
    std::optional<MeshCandidates> mesh;  ///< none where IPC Toolkit's method has to answer
  };
  static constexpr std::size_t kMostElements = 4;

  template <std::size_t kColumns>
  static std::vector<std::array<std::int32_t, kColumns>> rows(const Eigen::MatrixXi& matrix) {
    std::vector<std::array<std::int32_t, kColumns>> rows(static_cast<std::size_t>(matrix.rows()));
    for (Eigen::Index i = 0; i < matrix.rows(); ++i)
      for (std::size_t k = 0; k < kColumns; ++k)
        rows[static_cast<std::size_t>(i)][k] = matrix(i, static_cast<Eigen::Index>(k));
    return rows;
  }

  // (n, 3); of two dimensions in the plane z = 0.
  static std::vector<double> positions(const Eigen::MatrixXd& vertices) {
    std::vector<double> positions(3 * static_cast<std::size_t>(vertices.rows()), 0.0);
    for (Eigen::Index k = 0; k < std::min<Eigen::Index>(3, vertices.cols()); ++k)
      for (Eigen::Index i = 0; i < vertices.rows(); ++i)
        positions[static_cast<std::size_t>(3 * i + k)] = vertices(i, k);
    return positions;
  }

  static bool same(const Eigen::MatrixXi& a, Eigen::ConstRef<Eigen::MatrixXi> b) {
    return a.rows() == b.rows() && a.cols() == b.cols() && (a.array() == b.array()).all();
  }

  void begin(Eigen::ConstRef<Eigen::MatrixXi> edges, Eigen::ConstRef<Eigen::MatrixXi> faces,
             double inflation_radius) {
    clear();
    dim = static_cast<std::uint8_t>(vertices_t0_.cols());
    inflation_radius_ = inflation_radius;
    take_elements(edges, faces);
    // Twice a double is exact: as far apart are two vertices whose spheres touch.
    if (current_->mesh)
      current_->mesh->ask_about({positions(vertices_t0_), positions(vertices_t1_), 2 * inflation_radius});
  }

  void take_elements(Eigen::ConstRef<Eigen::MatrixXi> edges, Eigen::ConstRef<Eigen::MatrixXi> faces) {
    const Eigen::Index n = vertices_t0_.rows();
    const auto known = std::find_if(known_.begin(), known_.end(), [&](const auto& elements) {
      return elements->vertex_count == n && same(elements->edges, edges) && same(elements->faces, faces);
    });
    if (known != known_.end()) {
      std::rotate(known_.begin(), known, known + 1);
    } else {
      auto elements = std::make_unique<Elements>(Elements{n, edges, faces, std::nullopt});
      Mesh mesh{static_cast<std::size_t>(n), rows<2>(elements->edges), rows<3>(elements->faces), {}};
      if (!patches_.empty() && patches_.size() != mesh.vertex_count)
        throw std::invalid_argument("warmfront: patches: " + std::to_string(patches_.size()) +
                                    " numbers for a mesh of " + std::to_string(mesh.vertex_count) +
                                    " vertices; give one for each, or none");
      mesh.patches = patches_;
      elements->mesh = MeshCandidates::create(std::move(mesh), workers_);
      known_.insert(known_.begin(), std::move(elements));
      if (known_.size() > kMostElements) known_.pop_back();
    }
    current_ = known_.front().get();
  }

  bool answers() const { return current_ != nullptr && current_->mesh.has_value(); }

  // IPC Toolkit's own method, built of the same.
  const ::ipc::BroadPhase& other() const {
    other_->can_vertices_collide = can_vertices_collide;
    if (!other_is_built_ && current_ != nullptr) {
      const Elements& elements = *current_;
      if (vertices_t1_.rows() > 0) {
        other_->build(vertices_t0_, vertices_t1_, elements.edges, elements.faces, inflation_radius_);
      } else {
        other_->build(vertices_t0_, elements.edges, elements.faces, inflation_radius_);
      }
      other_is_built_ = true;
    }
    return *other_;
  }

  std::array<std::int32_t, 2> edge(std::int32_t e) const {
    return current_->mesh->mesh().edges[static_cast<std::size_t>(e)];
  }
  std::array<std::int32_t, 3> face(std::int32_t f) const {
    return current_->mesh->mesh().faces[static_cast<std::size_t>(f)];
  }

  // As all of IPC Toolkit's methods have it: whoever can collide with one vertex of the other.
  template <class First, class Second>
  bool can_collide(const First& first, const Second& second) const {
    for (const std::int32_t a : first)
      for (const std::int32_t b : second)
        if (can_vertices_collide(static_cast<std::size_t>(a), static_cast<std::size_t>(b))) return true;
    return false;
  }

  std::shared_ptr<Workers> workers_;
  std::vector<std::uint32_t> patches_;
  std::vector<std::unique_ptr<Elements>> known_;  // the last that were built first
  Elements* current_ = nullptr;
  Eigen::MatrixXd vertices_t0_;
  Eigen::MatrixXd vertices_t1_;  // without rows: a state
  double inflation_radius_ = 0;
  std::unique_ptr<::ipc::BroadPhase> other_;
  mutable bool other_is_built_ = false;
  mutable std::mutex mutex_;
};

}  // namespace warmfront::ipc_toolkit
