// SPDX-License-Identifier: Apache-2.0
// A small position-based cloth (Mueller et al. 2007; small steps: Macklin et al. 2019), with a fixed order of
// operations. It needs to be plausible and reproducible, not accurate. Used by one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/scenes/math.h"

namespace warmfront::client::scenes {

/// A round obstacle: a sphere when a == b, else a capsule. It moves rigidly: `velocity` at `a`, and a spin.
struct Obstacle {
  Vec3 a, b;
  double radius = 0;
  Vec3 velocity;
  Vec3 spin;  ///< radians a second about an axis through `a`
};

class Cloth {
 public:
  /// The particles are `positions`; the cells of each grid added below index them.
  explicit Cloth(std::span<const Vec3> positions);

  /// Links the (rows + 1) x columns grid (or columns + 1 without wrapping) of particles from `first` on at
  /// their current distances: along the cells, across them, and to every second particle against bending.
  void link_grid(std::uint32_t first, int rows, int columns, bool wrap_columns);

  /// Holds two particles at their current distance, until untie().
  void tie(std::uint32_t p, std::uint32_t q) { link(p, q, 1); }
  void untie(std::uint32_t p, std::uint32_t q) {
    std::erase_if(links_, [&](const Link& link) { return link.p == p && link.q == q; });
  }

  /// Keeps a particle no farther from a pinned one than `stretch` times their distance now (long range
  /// attachments: Kim, Chentanez and Mueller 2012): however fine the grid, it hangs no deeper.
  void tether(std::uint32_t p, std::uint32_t pinned, double stretch) {
    tethers_.push_back({p, pinned, stretch * norm(positions_[p] - positions_[pinned]), 1});
  }

  /// Particle `p` stays on its side of the grid of link_grid() without wrapping, by `distance`, however fast
  /// it falls; it begins above the cell coordinates (row, column), and sticks where it lands.
  void lay_on_grid(std::uint32_t p, std::uint32_t first, int rows, int columns, double row, double column,
                   double distance) {
    laid_.push_back({p, first, rows, columns, row, column, distance});
  }

  /// Particle `p` is moved by move_pinned() only.
  void pin(std::uint32_t p);
  void move_pinned(std::uint32_t p, Vec3 to) { positions_[p] = to; }

  /// Before a frame's substeps: finds which particles may meet (cells of `thickness`).
  void find_neighbours(double thickness);

  /// One substep of `seconds` under gravity, above the floor z = 0, outside the obstacles, layers kept apart.
  void substep(double seconds, std::span<const Obstacle> obstacles);

  std::span<const Vec3> positions() const { return positions_; }

 private:
  struct Link {
    std::uint32_t p, q;
    double length;
    double stiffness;  ///< share of the error removed at each visit
  };

  void link(std::uint32_t p, std::uint32_t q, double stiffness);
  /// A particle over a grid: what is below it is at these cell coordinates.
  struct Laid {
    std::uint32_t p, first;
    int rows, columns;
    double row, column;
    double distance;
  };
  /// A place of a grid: the four corners of its cell, and their weights.
  struct Patch {
    std::array<std::uint32_t, 4> corners;
    std::array<double, 4> weights;
    Vec3 along_rows, along_columns;  ///< how the place moves with its coordinates
  };

  Patch patch_of(const Laid& laid) const;
  void satisfy_links();
  void satisfy_tethers();
  void stay_above();
  void separate_layers();
  void leave_obstacles(double seconds, std::span<const Obstacle> obstacles);

  std::vector<Vec3> rest_;
  std::vector<Vec3> positions_;
  std::vector<Vec3> previous_;
  std::vector<Vec3> velocities_;
  std::vector<double> mobility_;  ///< inverse mass: 1, or 0 when pinned
  std::vector<Link> links_;
  std::vector<Link> tethers_;  // q is pinned
  std::vector<Laid> laid_;
  double thickness_ = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> neighbours_;
};

}  // namespace warmfront::client::scenes
