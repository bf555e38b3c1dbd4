// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/rigid_fit.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "engine/parallel/join_pieces.h"

namespace warmfront {
namespace {

using Vector = std::array<double, 3>;

Vector minus(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector position(const VertexMotion& vertex, bool start) {
  const auto& x = start ? vertex.t0 : vertex.t1;
  return {x[0], x[1], x[2]};
}
// False for what has no direction. A unit vector up to rounding, however short it was.
bool normalise(Vector& a) {
  const double largest = std::max({std::fabs(a[0]), std::fabs(a[1]), std::fabs(a[2])});
  for (double& x : a) x /= largest;
  const double length = std::sqrt(dot(a, a));
  for (double& x : a) x /= length;
  return length > 0 && std::isfinite(length);
}

// The columns of an orthonormal frame: along a b, and the plane of c.
bool frame_of(const Vector& a, const Vector& b, const Vector& c, LinearMap& frame) {
  Vector along = minus(b, a);
  if (!normalise(along)) return false;
  Vector normal = cross(along, minus(c, a));
  if (!normalise(normal)) return false;
  const Vector third = cross(normal, along);
  for (int row = 0; row < 3; ++row) {
    frame[3 * row] = along[row];
    frame[3 * row + 1] = third[row];
    frame[3 * row + 2] = normal[row];
  }
  return true;
}

LinearMap times(const LinearMap& a, const LinearMap& b) {
  LinearMap product;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += a[3 * row + k] * b[3 * k + column];
      product[3 * row + column] = sum;
    }
  }
  return product;
}

// Of columns with a volume.
LinearMap inverse(const LinearMap& m) {
  const Vector a{m[0], m[3], m[6]};
  const Vector b{m[1], m[4], m[7]};
  const Vector c{m[2], m[5], m[8]};
  const std::array<Vector, 3> rows{cross(b, c), cross(c, a), cross(a, b)};
  const double volume = dot(a, rows[0]);
  LinearMap inverse;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) inverse[3 * row + column] = rows[row][column] / volume;
  }
  return inverse;
}

/// What is lower than this share of its length is taken for flat: rounding to float32 would turn its height.
constexpr double kInPlane = 1e-4;

}  // namespace

RigidReference::RigidReference(std::span<const VertexMotion> vertices, StopSignal stop) {
  lengthen(positions_, 3 * vertices.size(), 0.0, stop);
  struct Extent {
    Vector lo, hi;
  };
  Extent none;
  none.lo.fill(std::numeric_limits<double>::infinity());
  none.hi.fill(-std::numeric_limits<double>::infinity());
  const auto copy = [&](std::size_t first, std::size_t end) {
    Extent extent = none;
    for (std::size_t v = first; v < end; ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double x = vertices[v].t0[axis];
        positions_[3 * v + axis] = x;
        extent.lo[axis] = std::min(extent.lo[axis], x);
        extent.hi[axis] = std::max(extent.hi[axis], x);
      }
    }
    return extent;
  };
  const auto widen = [](Extent& all, const Extent& piece) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      all.lo[axis] = std::min(all.lo[axis], piece.lo[axis]);
      all.hi[axis] = std::max(all.hi[axis], piece.hi[axis]);
    }
  };
  const auto [lo, hi] = join_pieces(0, vertices.size(), stop, none, copy, widen);
  if (vertices.empty()) return;
  for (std::size_t axis = 0; axis < 3; ++axis)
    reach_ = std::max({reach_, std::fabs(lo[axis]), std::fabs(hi[axis])});
  if (vertices.size() < 3) return;
  const double diagonal = std::sqrt(dot(minus(hi, lo), minus(hi, lo)));
  const auto at = [&](std::size_t v) { return position(vertices[v], true); };
  // The vertex for which something is largest; the first of several.
  const auto most = [&](auto&& measure) {
    struct Largest {
      double value = -1;
      std::uint32_t vertex = 0;
    };
    const auto of_piece = [&](std::size_t first, std::size_t end) {
      Largest largest;
      for (std::size_t v = first; v < end; ++v) {
        const double value = measure(at(v));
        if (value > largest.value) largest = {value, static_cast<std::uint32_t>(v)};
      }
      return largest;
    };
    const auto larger = [](Largest& all, const Largest& piece) {
      if (piece.value > all.value || (piece.value == all.value && piece.vertex < all.vertex)) all = piece;
    };
    return join_pieces(0, vertices.size(), stop, Largest{}, of_piece, larger).vertex;
  };
  const auto away_from = [](const Vector& from) {
    return [from](const Vector& x) { return dot(minus(x, from), minus(x, from)); };
  };
  anchors_[0] = most(away_from(at(0)));
  anchors_[1] = most(away_from(at(anchors_[0])));
  Vector along = minus(at(anchors_[1]), at(anchors_[0]));
  if (!normalise(along)) return;
  const auto off_line = [&](const Vector& x) {
    const Vector off = cross(along, minus(x, at(anchors_[0])));
    return dot(off, off);
  };
  anchors_[2] = most(off_line);
  // A frame of three on a line would turn with their rounding, and squares are to be within double's range.
  if (!(std::sqrt(off_line(at(anchors_[2]))) > 1e-6 * diagonal)) return;
  if (!(diagonal > 1e-140 && reach_ < 1e140)) return;
  flat_ = !frame_of(at(anchors_[0]), at(anchors_[1]), at(anchors_[2]), frame_);
  if (flat_) return;
  const auto height = [&](const Vector& x) {
    const Vector off = minus(x, at(anchors_[0]));
    return std::fabs(frame_[2] * off[0] + frame_[5] * off[1] + frame_[8] * off[2]);
  };
  anchors_[3] = most(height);
  const Vector first = minus(at(anchors_[1]), at(anchors_[0]));
  unit_ = std::sqrt(dot(first, first));
  in_plane_ = !(height(at(anchors_[3])) > kInPlane * unit_);
  LinearMap edges;
  edges_of(vertices, true, edges);
  from_edges_ = inverse(edges);
}

RigidReference::Fit RigidReference::fit(std::span<const VertexMotion> vertices, bool start, double limit,
                                        StopSignal stop) const {
  Fit fit;
  fit.residual = std::numeric_limits<double>::infinity();
  const Vector origin = position(vertices[anchors_[0]], start);
  LinearMap frame;
  if (flat_ || !frame_of(origin, position(vertices[anchors_[1]], start),
                         position(vertices[anchors_[2]], start), frame))
    return fit;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += frame[3 * row + k] * frame_[3 * column + k];
      fit.linear[3 * row + column] = sum;
    }
  }
  measure(vertices, start, limit, fit, stop);
  return fit;
}

bool RigidReference::edges_of(std::span<const VertexMotion> vertices, bool start, LinearMap& edges) const {
  const Vector origin = position(vertices[anchors_[0]], start);
  std::array<Vector, 3> columns;
  for (std::size_t k = 0; k < 3; ++k) {
    columns[k] = minus(position(vertices[anchors_[k + 1]], start), origin);
    for (double& x : columns[k]) x /= unit_;
  }
  if (in_plane_) {
    columns[2] = cross(columns[0], columns[1]);
    if (!normalise(columns[2])) return false;
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) edges[3 * row + column] = columns[column][row];
  }
  return true;
}

RigidReference::Fit RigidReference::fit_between(std::span<const VertexMotion> vertices, bool start,
                                                double limit, StopSignal stop) const {
  Fit fit;
  fit.turned = false;
  fit.residual = std::numeric_limits<double>::infinity();
  LinearMap edges;
  if (flat_ || !edges_of(vertices, start, edges)) return fit;
  fit.linear = times(edges, from_edges_);
  // Beyond this nothing remains spread, and rounding would be more than measure() allows for.
  if (!std::ranges::all_of(fit.linear, [](double x) { return std::fabs(x) < 2; })) return fit;
  measure(vertices, start, limit, fit, stop);
  return fit;
}

// How far the vertices are from where the linear map, about the first anchor, puts their references, if no
// farther than the limit.
void RigidReference::measure(std::span<const VertexMotion> vertices, bool start, double limit, Fit& fit,
                             StopSignal stop) const {
  const Vector origin = position(vertices[anchors_[0]], start);
  const double* reference = positions_.data();
  const double* rest = reference + std::size_t{3} * anchors_[0];
  const auto& r = fit.linear;
  const auto off = [&](std::size_t v) {
    const double* x = reference + 3 * v;
    const Vector from{x[0] - rest[0], x[1] - rest[1], x[2] - rest[2]};
    const auto& to = start ? vertices[v].t0 : vertices[v].t1;
    double square = 0;
    for (int row = 0; row < 3; ++row) {
      const double turned = r[3 * row] * from[0] + r[3 * row + 1] * from[1] + r[3 * row + 2] * from[2];
      const double difference = to[row] - origin[row] - turned;
      square += difference * difference;
    }
    return square;
  };
  // Some first: what deforms shows it at once.
  constexpr std::size_t kSample = 16;
  const double most = limit * limit;
  for (std::size_t k = 0; k < kSample; ++k) {
    if (!(off(k * vertices.size() / kSample) <= most)) return;
  }
  struct Farthest {
    double square = 0;
    double reach = 0;
  };
  std::atomic<bool> near{true};  // all of them; where one is not, the rest need not be measured
  const auto of_piece = [&](std::size_t first, std::size_t end) {
    Farthest farthest;
    bool all_near = near.load(std::memory_order_relaxed);
    for (std::size_t v = first; all_near && v < end; ++v) {
      const double distance = off(v);
      all_near = distance <= most;  // not a number, too
      farthest.square = std::max(farthest.square, distance);
      const auto& to = start ? vertices[v].t0 : vertices[v].t1;
      farthest.reach = std::max({farthest.reach, std::fabs(to[0]), std::fabs(to[1]), std::fabs(to[2])});
    }
    if (!all_near) near.store(false, std::memory_order_relaxed);
    return farthest;
  };
  const auto join = [](Farthest& all, const Farthest& piece) {
    all.square = std::max(all.square, piece.square);
    all.reach = std::max(all.reach, piece.reach);
  };
  const Farthest all = join_pieces(0, vertices.size(), stop, Farthest{}, of_piece, join);
  if (!near.load(std::memory_order_relaxed)) return;
  const double reach = std::max(reach_, all.reach);
  // Some forty operations on coordinates up to `reach`, each off by 2^-53 of it at most: 2^-46 covers them.
  const double residual = std::sqrt(all.square) + 0x1p-46 * reach;
  if (residual <= limit) fit.residual = residual;
}

double cosine_between(const LinearMap& a, const LinearMap& b) {
  double trace = 0;
  for (std::size_t k = 0; k < a.size(); ++k) trace += a[k] * b[k];
  return 0.5 * (trace - 1);
}

}  // namespace warmfront
