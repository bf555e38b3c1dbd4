// SPDX-License-Identifier: Apache-2.0
// What the plug for IPC Toolkit takes of that library, declared as it declares it, so that the plug is
// compiled and tested where the library is not installed: names, signatures, and one method, by brute force.
// Test code.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace Eigen {
template <class Matrix>
using ConstRef = const Ref<const Matrix>&;
}

namespace ipc {

using index_t = std::int32_t;
using VectorMax3d = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;
using CollisionFilter = std::function<bool(std::size_t, std::size_t)>;

struct AABB {
  Eigen::Array3d min;
  Eigen::Array3d max;
  std::array<index_t, 3> vertex_ids;

  void add(const AABB& more) {
    min = min.min(more.min);
    max = max.max(more.max);
  }
  bool intersects(const AABB& other) const { return (min <= other.max).all() && (other.min <= max).all(); }
};
using AABBs = std::vector<AABB>;

struct VertexVertexCandidate {
  VertexVertexCandidate(index_t a, index_t b) : vertex0_id(a), vertex1_id(b) {}
  index_t vertex0_id, vertex1_id;
};
struct EdgeVertexCandidate {
  EdgeVertexCandidate(index_t e, index_t v) : edge_id(e), vertex_id(v) {}
  index_t edge_id, vertex_id;
};
struct EdgeEdgeCandidate {
  EdgeEdgeCandidate(index_t a, index_t b) : edge0_id(a), edge1_id(b) {}
  index_t edge0_id, edge1_id;
};
struct FaceVertexCandidate {
  FaceVertexCandidate(index_t f, index_t v) : face_id(f), vertex_id(v) {}
  index_t face_id, vertex_id;
};
struct EdgeFaceCandidate {
  EdgeFaceCandidate(index_t e, index_t f) : edge_id(e), face_id(f) {}
  index_t edge_id, face_id;
};
struct FaceFaceCandidate {
  FaceFaceCandidate(index_t a, index_t b) : face0_id(a), face1_id(b) {}
  index_t face0_id, face1_id;
};

class BroadPhase {
 public:
  using Vertices = Eigen::MatrixXd;
  using Elements = Eigen::MatrixXi;

  virtual ~BroadPhase() = default;
  virtual std::string name() const = 0;
  virtual void build(Eigen::ConstRef<Vertices> vertices, Eigen::ConstRef<Elements> edges,
                     Eigen::ConstRef<Elements> faces, const double inflation_radius = 0) = 0;
  virtual void build(Eigen::ConstRef<Vertices> vertices_t0, Eigen::ConstRef<Vertices> vertices_t1,
                     Eigen::ConstRef<Elements> edges, Eigen::ConstRef<Elements> faces,
                     const double inflation_radius = 0) = 0;
  virtual void build(const AABBs& vertex_boxes, Eigen::ConstRef<Elements> edges,
                     Eigen::ConstRef<Elements> faces, const std::uint8_t dim) = 0;
  virtual void clear() { dim = 0; }
  virtual void detect_vertex_vertex_candidates(std::vector<VertexVertexCandidate>& candidates) const = 0;
  virtual void detect_edge_vertex_candidates(std::vector<EdgeVertexCandidate>& candidates) const = 0;
  virtual void detect_edge_edge_candidates(std::vector<EdgeEdgeCandidate>& candidates) const = 0;
  virtual void detect_face_vertex_candidates(std::vector<FaceVertexCandidate>& candidates) const = 0;
  virtual void detect_edge_face_candidates(std::vector<EdgeFaceCandidate>& candidates) const = 0;
  virtual void detect_face_face_candidates(std::vector<FaceFaceCandidate>& candidates) const = 0;

  CollisionFilter can_vertices_collide = [](std::size_t, std::size_t) { return true; };

 protected:
  std::uint8_t dim = 0;
};

/// All pairs whose boxes overlap.
class BruteForce : public BroadPhase {
 public:
  std::string name() const override { return "BruteForce"; }
  void build(Eigen::ConstRef<Vertices> vertices, Eigen::ConstRef<Elements> edges,
             Eigen::ConstRef<Elements> faces, const double inflation_radius) override {
    build(vertices, vertices, edges, faces, inflation_radius);
  }
  void build(Eigen::ConstRef<Vertices> vertices_t0, Eigen::ConstRef<Vertices> vertices_t1,
             Eigen::ConstRef<Elements> edges, Eigen::ConstRef<Elements> faces,
             const double inflation_radius) override {
    AABBs boxes(static_cast<std::size_t>(vertices_t0.rows()));
    for (Eigen::Index i = 0; i < vertices_t0.rows(); ++i) {
      AABB& box = boxes[static_cast<std::size_t>(i)];
      box = {Eigen::Array3d::Zero(), Eigen::Array3d::Zero(), {static_cast<index_t>(i), -1, -1}};
      for (Eigen::Index k = 0; k < vertices_t0.cols(); ++k) {
        box.min[k] = std::min(vertices_t0(i, k), vertices_t1(i, k)) - inflation_radius;
        box.max[k] = std::max(vertices_t0(i, k), vertices_t1(i, k)) + inflation_radius;
      }
    }
    build(boxes, edges, faces, static_cast<std::uint8_t>(vertices_t0.cols()));
  }
  void build(const AABBs& vertex_boxes, Eigen::ConstRef<Elements> edges, Eigen::ConstRef<Elements> faces,
             const std::uint8_t dimension) override {
    dim = dimension;
    vertices_ = vertex_boxes;
    edges_ = boxes_of(edges);
    faces_ = boxes_of(faces);
  }
  void detect_vertex_vertex_candidates(std::vector<VertexVertexCandidate>& candidates) const override {
    detect(vertices_, vertices_, true, candidates);
  }
  void detect_edge_vertex_candidates(std::vector<EdgeVertexCandidate>& candidates) const override {
    detect(edges_, vertices_, false, candidates);
  }
  void detect_edge_edge_candidates(std::vector<EdgeEdgeCandidate>& candidates) const override {
    detect(edges_, edges_, true, candidates);
  }
  void detect_face_vertex_candidates(std::vector<FaceVertexCandidate>& candidates) const override {
    detect(faces_, vertices_, false, candidates);
  }
  void detect_edge_face_candidates(std::vector<EdgeFaceCandidate>& candidates) const override {
    detect(edges_, faces_, false, candidates);
  }
  void detect_face_face_candidates(std::vector<FaceFaceCandidate>& candidates) const override {
    detect(faces_, faces_, true, candidates);
  }

 private:
  AABBs boxes_of(const Elements& elements) const {
    AABBs boxes;
    for (Eigen::Index i = 0; i < elements.rows(); ++i) {
      AABB box = vertices_[static_cast<std::size_t>(elements(i, 0))];
      for (Eigen::Index k = 0; k < elements.cols(); ++k) {
        box.add(vertices_[static_cast<std::size_t>(elements(i, k))]);
        box.vertex_ids[static_cast<std::size_t>(k)] = elements(i, k);
      }
      boxes.push_back(box);
    }
    return boxes;
  }
  bool can_collide(const AABB& a, const AABB& b) const {
    bool any = false;
    for (const index_t v : a.vertex_ids) {
      for (const index_t w : b.vertex_ids) {
        if (v < 0 || w < 0) continue;
        if (v == w) return false;
        any |= can_vertices_collide(static_cast<std::size_t>(v), static_cast<std::size_t>(w));
      }
    }
    return any;
  }
  template <class Candidate>
  void detect(const AABBs& first, const AABBs& second, bool of_one_kind,
              std::vector<Candidate>& candidates) const {
    for (std::size_t i = 0; i < first.size(); ++i)
      for (std::size_t j = of_one_kind ? i + 1 : 0; j < second.size(); ++j)
        if (first[i].intersects(second[j]) && can_collide(first[i], second[j]))
          candidates.emplace_back(static_cast<index_t>(i), static_cast<index_t>(j));
  }

  AABBs vertices_, edges_, faces_;
};

inline std::unique_ptr<BroadPhase> make_default_broad_phase() {
  return std::make_unique<BruteForce>();
}

class NarrowPhaseCCD {
 public:
  virtual ~NarrowPhaseCCD() = default;
  virtual bool point_point_ccd(Eigen::ConstRef<VectorMax3d> p0_t0, Eigen::ConstRef<VectorMax3d> p1_t0,
                               Eigen::ConstRef<VectorMax3d> p0_t1, Eigen::ConstRef<VectorMax3d> p1_t1,
                               double& toi, const double min_distance = 0.0,
                               const double tmax = 1.0) const = 0;
  virtual bool point_edge_ccd(Eigen::ConstRef<VectorMax3d> p_t0, Eigen::ConstRef<VectorMax3d> e0_t0,
                              Eigen::ConstRef<VectorMax3d> e1_t0, Eigen::ConstRef<VectorMax3d> p_t1,
                              Eigen::ConstRef<VectorMax3d> e0_t1, Eigen::ConstRef<VectorMax3d> e1_t1,
                              double& toi, const double min_distance = 0.0,
                              const double tmax = 1.0) const = 0;
  virtual bool point_triangle_ccd(
      Eigen::ConstRef<Eigen::Vector3d> p_t0, Eigen::ConstRef<Eigen::Vector3d> t0_t0,
      Eigen::ConstRef<Eigen::Vector3d> t1_t0, Eigen::ConstRef<Eigen::Vector3d> t2_t0,
      Eigen::ConstRef<Eigen::Vector3d> p_t1, Eigen::ConstRef<Eigen::Vector3d> t0_t1,
      Eigen::ConstRef<Eigen::Vector3d> t1_t1, Eigen::ConstRef<Eigen::Vector3d> t2_t1, double& toi,
      const double min_distance = 0.0, const double tmax = 1.0) const = 0;
  virtual bool edge_edge_ccd(Eigen::ConstRef<Eigen::Vector3d> ea0_t0, Eigen::ConstRef<Eigen::Vector3d> ea1_t0,
                             Eigen::ConstRef<Eigen::Vector3d> eb0_t0, Eigen::ConstRef<Eigen::Vector3d> eb1_t0,
                             Eigen::ConstRef<Eigen::Vector3d> ea0_t1, Eigen::ConstRef<Eigen::Vector3d> ea1_t1,
                             Eigen::ConstRef<Eigen::Vector3d> eb0_t1, Eigen::ConstRef<Eigen::Vector3d> eb1_t1,
                             double& toi, const double min_distance = 0.0, const double tmax = 1.0) const = 0;

  double conservative_rescaling;
};

}  // namespace ipc
