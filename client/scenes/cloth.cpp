// SPDX-License-Identifier: Apache-2.0
// The cloth: see cloth.h.
#include "client/scenes/cloth.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace warmfront::client::scenes {
namespace {

constexpr Vec3 kGravity{0, 0, -9.81};
constexpr double kAirDrag = 0.6;    // of the velocity, a second
constexpr double kFriction = 0.35;  // of a contact's depth, sideways
constexpr double kTopSpeed = 12;    // metres a second
constexpr double kBending = 0.15;

/// Particles by cells of a grid, hashed into as many buckets as there are particles.
class Buckets {
 public:
  Buckets(std::span<const Vec3> points, double cell)
      : cell_(cell), start_(points.size() + 1, 0), items_(points.size()) {
    std::vector<std::uint32_t> bucket(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      bucket[i] = bucket_of(index(points[i].x), index(points[i].y), index(points[i].z));
      ++start_[bucket[i] + 1];
    }
    for (std::size_t b = 1; b < start_.size(); ++b) start_[b] += start_[b - 1];
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) items_[next[bucket[i]]++] = static_cast<std::uint32_t>(i);
  }

  std::int64_t index(double x) const { return static_cast<std::int64_t>(std::floor(x / cell_)); }

  std::span<const std::uint32_t> at(std::int64_t i, std::int64_t j, std::int64_t k) const {
    const std::uint32_t b = bucket_of(i, j, k);
    return std::span(items_).subspan(start_[b], start_[b + 1] - start_[b]);
  }

 private:
  std::uint32_t bucket_of(std::int64_t i, std::int64_t j, std::int64_t k) const {
    const auto mix = static_cast<std::uint64_t>(i) * 73856093U ^ static_cast<std::uint64_t>(j) * 19349663U ^
                     static_cast<std::uint64_t>(k) * 83492791U;
    return static_cast<std::uint32_t>(mix % (start_.size() - 1));
  }

  double cell_;
  std::vector<std::uint32_t> start_;
  std::vector<std::uint32_t> items_;
};

}  // namespace

Cloth::Cloth(std::span<const Vec3> positions)
    : rest_(positions.begin(), positions.end()),
      positions_(rest_),
      previous_(rest_),
      velocities_(rest_.size()),
      mobility_(rest_.size(), 1) {}

void Cloth::pin(std::uint32_t p) {
  mobility_[p] = 0;
}

void Cloth::link(std::uint32_t p, std::uint32_t q, double stiffness) {
  links_.push_back({p, q, norm(positions_[p] - positions_[q]), stiffness});
}

void Cloth::link_grid(std::uint32_t first, int rows, int columns, bool wrap_columns) {
  const int width = wrap_columns ? columns : columns + 1;
  const auto at = [&](int r, int c) { return first + static_cast<std::uint32_t>(r * width + c % width); };
  // With wrapping there is no column beyond the last.
  const auto inside = [&](int r, int c) { return r <= rows && (wrap_columns || c < width); };
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c < width; ++c) {
      if (inside(r, c + 1)) link(at(r, c), at(r, c + 1), 1);
      if (inside(r + 1, c)) link(at(r, c), at(r + 1, c), 1);
      if (inside(r + 1, c + 1)) {
        link(at(r, c), at(r + 1, c + 1), 0.6);
        link(at(r, c + 1), at(r + 1, c), 0.6);
      }
      if (inside(r, c + 2)) link(at(r, c), at(r, c + 2), kBending);
      if (inside(r + 2, c)) link(at(r, c), at(r + 2, c), kBending);
    }
}

void Cloth::find_neighbours(double thickness) {
  thickness_ = thickness;
  // Particles that may come near within the frame; later ones are found in the next.
  const double reach = 1.5 * thickness;
  neighbours_.clear();
  const Buckets buckets(positions_, reach);
  for (std::uint32_t p = 0; p < positions_.size(); ++p) {
    const Vec3 x = positions_[p];
    const std::int64_t ci = buckets.index(x.x), cj = buckets.index(x.y), ck = buckets.index(x.z);
    for (std::int64_t i = ci - 1; i <= ci + 1; ++i)
      for (std::int64_t j = cj - 1; j <= cj + 1; ++j)
        for (std::int64_t k = ck - 1; k <= ck + 1; ++k)
          for (const std::uint32_t q : buckets.at(i, j, k)) {
            if (q <= p) continue;
            const Vec3 apart = positions_[q] - x;
            if (dot(apart, apart) > reach * reach) continue;
            const Vec3 rest = rest_[q] - rest_[p];
            if (dot(rest, rest) < 4 * thickness * thickness) continue;
            neighbours_.emplace_back(p, q);
          }
  }
  // Two cells that share a bucket list a pair twice.
  std::sort(neighbours_.begin(), neighbours_.end());
  neighbours_.erase(std::unique(neighbours_.begin(), neighbours_.end()), neighbours_.end());
}

void Cloth::satisfy_links() {
  for (const Link& link : links_) {
    const double mobility = mobility_[link.p] + mobility_[link.q];
    const Vec3 apart = positions_[link.q] - positions_[link.p];
    const double distance = norm(apart);
    if (mobility == 0 || distance == 0) continue;
    const Vec3 step = (link.stiffness * (distance - link.length) / (distance * mobility)) * apart;
    positions_[link.p] += mobility_[link.p] * step;
    positions_[link.q] -= mobility_[link.q] * step;
  }
}

void Cloth::separate_layers() {
  for (const auto& [p, q] : neighbours_) {
    const double mobility = mobility_[p] + mobility_[q];
    const Vec3 apart = positions_[q] - positions_[p];
    const double square = dot(apart, apart);
    if (mobility == 0 || square == 0 || square >= thickness_ * thickness_) continue;
    const double distance = std::sqrt(square);
    const Vec3 step = ((thickness_ - distance) / (distance * mobility)) * apart;
    positions_[p] -= mobility_[p] * step;
    positions_[q] += mobility_[q] * step;
  }
}

void Cloth::satisfy_tethers() {
  for (const Link& tether : tethers_) {
    const Vec3 apart = positions_[tether.p] - positions_[tether.q];
    const double distance = norm(apart);
    if (distance > tether.length) positions_[tether.p] -= ((distance - tether.length) / distance) * apart;
  }
}

Cloth::Patch Cloth::patch_of(const Laid& laid) const {
  const int r = std::clamp(static_cast<int>(laid.row), 0, laid.rows - 1);
  const int c = std::clamp(static_cast<int>(laid.column), 0, laid.columns - 1);
  const double s = laid.row - r, t = laid.column - c;
  const auto at = [&](int row, int column) {
    return laid.first + static_cast<std::uint32_t>(row * (laid.columns + 1) + column);
  };
  Patch patch{{at(r, c), at(r, c + 1), at(r + 1, c), at(r + 1, c + 1)},
              {(1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t},
              {},
              {}};
  const auto x = [&](int corner) { return positions_[patch.corners.at(static_cast<std::size_t>(corner))]; };
  patch.along_rows = (1 - t) * (x(2) - x(0)) + t * (x(3) - x(1));
  patch.along_columns = (1 - s) * (x(1) - x(0)) + s * (x(3) - x(2));
  return patch;
}

void Cloth::stay_above() {
  constexpr int kWalks = 3;          // towards the place below, a cell at most
  constexpr double kSticking = 0.5;  // of the way along the grid, taken back
  constexpr double kYielding = 0.3;  // of the depth, by which the grid gives way
  for (Laid& laid : laid_) {
    Vec3& x = positions_[laid.p];
    Patch patch{};
    const auto place = [&](const std::vector<Vec3>& positions) {
      Vec3 sum;
      for (std::size_t k = 0; k < 4; ++k) sum += patch.weights[k] * positions[patch.corners[k]];
      return sum;
    };
    bool beside = false;
    for (int walk = 0; walk < kWalks; ++walk) {
      patch = patch_of(laid);
      const Vec3 u = patch.along_rows, v = patch.along_columns, out = x - place(positions_);
      const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), det = uu * vv - uv * uv;
      if (!(det > 0)) break;
      const double rows = std::clamp((dot(out, u) * vv - dot(out, v) * uv) / det, -1.0, 1.0);
      const double columns = std::clamp((dot(out, v) * uu - dot(out, u) * uv) / det, -1.0, 1.0);
      const double row = std::clamp(laid.row + rows, 0.0, 1.0 * laid.rows);
      const double column = std::clamp(laid.column + columns, 0.0, 1.0 * laid.columns);
      beside = std::abs(row - laid.row - rows) + std::abs(column - laid.column - columns) > 0.5;
      laid.row = row;
      laid.column = column;
    }
    patch = patch_of(laid);
    const Vec3 across = cross(patch.along_columns, patch.along_rows);
    const double area = norm(across);
    if (beside || area == 0) continue;
    const Vec3 normal = (1 / area) * across;
    const double depth = laid.distance - dot(x - place(positions_), normal);
    if (depth <= 0) continue;
    double squares = 0;
    for (const double weight : patch.weights) squares += weight * weight;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t corner = patch.corners[k];
      positions_[corner] -= (kYielding * depth * mobility_[corner] * patch.weights[k] / squares) * normal;
    }
    x += (laid.distance - dot(x - place(positions_), normal)) * normal;
    Vec3 slide = x - previous_[laid.p] - (place(positions_) - place(previous_));
    slide -= dot(slide, normal) * normal;
    x -= kSticking * slide;
  }
}

void Cloth::leave_obstacles(double seconds, std::span<const Obstacle> obstacles) {
  for (std::size_t p = 0; p < positions_.size(); ++p) {
    if (mobility_[p] == 0) continue;
    Vec3& x = positions_[p];
    for (const Obstacle& obstacle : obstacles) {
      const Vec3 along = obstacle.b - obstacle.a;
      const double length2 = dot(along, along);
      const double share = length2 > 0 ? std::clamp(dot(x - obstacle.a, along) / length2, 0.0, 1.0) : 0;
      const Vec3 out = x - (obstacle.a + share * along);
      const double square = dot(out, out);
      if (square >= obstacle.radius * obstacle.radius || square == 0) continue;
      const double distance = std::sqrt(square);
      const Vec3 normal = (1 / distance) * out;
      const double depth = obstacle.radius - distance;
      x += depth * normal;
      // Coulomb friction: the surface drags the particle along, by no more than its share of the depth.
      const Vec3 surface = seconds * (obstacle.velocity + cross(obstacle.spin, x - obstacle.a));
      Vec3 slide = x - previous_[p] - surface;
      slide -= dot(slide, normal) * normal;
      const double sliding = norm(slide);
      const double most = kFriction * depth * 10;
      if (sliding > 0) x -= std::min(1.0, most / sliding) * slide;
    }
    if (x.z < 0) {
      const Vec3 was = previous_[p];
      x = {was.x + 0.5 * (x.x - was.x), was.y + 0.5 * (x.y - was.y), 0};
    }
  }
}

void Cloth::substep(double seconds, std::span<const Obstacle> obstacles) {
  for (std::size_t p = 0; p < positions_.size(); ++p) {
    if (mobility_[p] == 0) continue;
    previous_[p] = positions_[p];
    velocities_[p] = (1 - kAirDrag * seconds) * (velocities_[p] + seconds * kGravity);
    positions_[p] += seconds * velocities_[p];
  }
  satisfy_links();
  satisfy_tethers();
  separate_layers();
  stay_above();
  leave_obstacles(seconds, obstacles);
  for (std::size_t p = 0; p < positions_.size(); ++p) {
    if (mobility_[p] == 0) continue;
    Vec3 velocity = (1 / seconds) * (positions_[p] - previous_[p]);
    const double speed = norm(velocity);
    if (speed > kTopSpeed) velocity = (kTopSpeed / speed) * velocity;
    velocities_[p] = velocity;
  }
}

}  // namespace warmfront::client::scenes
