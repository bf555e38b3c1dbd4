// SPDX-License-Identifier: Apache-2.0
// See stand_in.hpp.
#pragma once

#include <ipc/stand_in.hpp>

namespace ipc {

class CollisionMesh {
 public:
  CollisionMesh(const Eigen::MatrixXd&, Eigen::MatrixXi edges, Eigen::MatrixXi faces)
      : edges_(std::move(edges)), faces_(std::move(faces)) {}
  const Eigen::MatrixXi& edges() const { return edges_; }
  const Eigen::MatrixXi& faces() const { return faces_; }

 private:
  Eigen::MatrixXi edges_, faces_;
};

/// In three dimensions.
class Candidates {
 public:
  using Vertices = Eigen::MatrixXd;

  void build(const CollisionMesh& mesh, Eigen::ConstRef<Vertices> vertices, double inflation_radius,
             BroadPhase* method) {
    method->build(vertices, mesh.edges(), mesh.faces(), inflation_radius);
    detect(*method);
  }
  void build(const CollisionMesh& mesh, Eigen::ConstRef<Vertices> vertices_t0,
             Eigen::ConstRef<Vertices> vertices_t1, double inflation_radius, BroadPhase* method) {
    method->build(vertices_t0, vertices_t1, mesh.edges(), mesh.faces(), inflation_radius);
    detect(*method);
  }
  std::size_t size() const { return edge_edge_.size() + face_vertex_.size(); }

  double compute_collision_free_stepsize(const CollisionMesh& mesh, Eigen::ConstRef<Vertices> vertices_t0,
                                         Eigen::ConstRef<Vertices> vertices_t1, double min_distance,
                                         const NarrowPhaseCCD& ccd) const {
    const auto at0 = [&](index_t v) { return Eigen::Vector3d(vertices_t0.row(v).transpose()); };
    const auto at1 = [&](index_t v) { return Eigen::Vector3d(vertices_t1.row(v).transpose()); };
    double least = 1;
    double toi = 1;
    for (const EdgeEdgeCandidate& c : edge_edge_) {
      const auto a = mesh.edges().row(c.edge0_id), b = mesh.edges().row(c.edge1_id);
      if (ccd.edge_edge_ccd(at0(a[0]), at0(a[1]), at0(b[0]), at0(b[1]), at1(a[0]), at1(a[1]), at1(b[0]),
                            at1(b[1]), toi, min_distance, least))
        least = std::min(least, toi);
    }
    for (const FaceVertexCandidate& c : face_vertex_) {
      const auto f = mesh.faces().row(c.face_id);
      if (ccd.point_triangle_ccd(at0(c.vertex_id), at0(f[0]), at0(f[1]), at0(f[2]), at1(c.vertex_id),
                                 at1(f[0]), at1(f[1]), at1(f[2]), toi, min_distance, least))
        least = std::min(least, toi);
    }
    return least;
  }

 private:
  void detect(const BroadPhase& method) {
    edge_edge_.clear();
    face_vertex_.clear();
    method.detect_edge_edge_candidates(edge_edge_);
    method.detect_face_vertex_candidates(face_vertex_);
  }

  std::vector<EdgeEdgeCandidate> edge_edge_;
  std::vector<FaceVertexCandidate> face_vertex_;
};

}  // namespace ipc
