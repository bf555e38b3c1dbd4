// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/pair_filter.h"

#include <algorithm>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

// What is left out of two faces for each set of their excluded pairs of vertices: bit 3 i + j for vertex i of
// f and j of g. A vertex and a face with a row (or column) that has any, two edges with such a square.
constexpr std::array<std::uint16_t, 512> left_out_by_vertices() {
  std::array<std::uint16_t, 512> table{};
  for (unsigned set = 0; set < 512; ++set) {
    const auto has = [&](unsigned i, unsigned j) { return ((set >> (3 * (i % 3) + j % 3)) & 1) != 0; };
    unsigned bits = 0;
    for (unsigned i = 0; i < 3; ++i) {
      if (has(i, 0) || has(i, 1) || has(i, 2)) bits |= 1U << i;
      if (has(0, i) || has(1, i) || has(2, i)) bits |= 1U << (3 + i);
      for (unsigned j = 0; j < 3; ++j) {
        if (has(i, j) || has(i, j + 1) || has(i + 1, j) || has(i + 1, j + 1)) bits |= 1U << (6 + 3 * i + j);
      }
    }
    table[set] = static_cast<std::uint16_t>(bits);
  }
  return table;
}
constexpr std::array<std::uint16_t, 512> kLeftOut = left_out_by_vertices();

}  // namespace

PairFilter::PairFilter(const PairFilters& filters, std::span<const FeatureRange> parts,
                       const Renumbering& numbering, const Scene& renumbered, StopSignal stop)
    : any_(filters.any()), excluded_(filters, parts, numbering, renumbered, stop) {
  const std::span<const GivenVertex> given = numbering.given_vertices();
  if (!filters.patches.empty()) {
    reserve(patches_, given.size(), stop);
    in_pieces(0, given.size(), stop, [&](std::size_t first, std::size_t end) {
      for (std::size_t v = first; v < end; ++v) patches_.push_back(filters.patches[number_of(given[v])]);
    });
  }
  rest_distance_ = filters.near_at_rest;
  if (!(rest_distance_ > 0)) return;
  // Squares are off by less than 2^-49 of them where digits are lost neither above nor below.
  const double squared = rest_distance_ * rest_distance_;
  squared_from_below_ = squared > 0x1p-960 && squared < 0x1p960 ? squared * (1 - 0x1p-48) : -1;
  reserve(at_rest_, given.size(), stop);
  in_pieces(0, given.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t v = first; v < end; ++v) {
      const double* x = filters.rest_positions.data() + std::size_t{3} * number_of(given[v]);
      at_rest_.push_back({x[0], x[1], x[2], 0});
    }
  });
}

bool PairFilter::is_near_at_rest(std::uint32_t v, std::uint32_t w) const {
  const std::array<double, 4>& x = at_rest_[v];
  const std::array<double, 4>& y = at_rest_[w];
  const double dx = x[0] - y[0];
  const double dy = x[1] - y[1];
  const double dz = x[2] - y[2];
  return dx * dx + dy * dy + dz * dz <= squared_from_below_;
}

std::uint32_t PairFilter::left_out(const Face& f, const Face& g) const {
  std::uint32_t set = excluded_.empty() ? 0 : excluded_.pairs_of(f, g);
  if (rest_distance_ > 0) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) set |= is_near_at_rest(f[i], g[j]) ? 1U << (3 * i + j) : 0;
    }
  }
  std::uint32_t bits = kLeftOut[set];
  if (patches_.empty()) return bits;
  const std::array<std::uint32_t, 3> p{patches_[f[0]], patches_[f[1]], patches_[f[2]]};
  const std::array<std::uint32_t, 3> q{patches_[g[0]], patches_[g[1]], patches_[g[2]]};
  const bool whole_f = p[0] != 0 && p[0] == p[1] && p[0] == p[2];
  const bool whole_g = q[0] != 0 && q[0] == q[1] && q[0] == q[2];
  if (whole_f && whole_g) return p[0] == q[0] ? kAll : bits;
  for (unsigned i = 0; i < 3; ++i) {
    if (whole_g && p[i] == q[0]) bits |= 1U << i;
    if (whole_f && q[i] == p[0]) bits |= 1U << (3 + i);
    for (unsigned j = 0; j < 3; ++j) {
      const std::uint32_t patch = p[i];
      if (patch != 0 && patch == p[(i + 1) % 3] && patch == q[j] && patch == q[(j + 1) % 3])
        bits |= 1U << (6 + 3 * i + j);
    }
  }
  return bits;
}

bool PairFilter::leaves_out(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) const {
  for (const std::uint32_t v : a) {
    for (const std::uint32_t w : b) {
      if (excludes(v, w)) return true;
    }
  }
  if (patches_.empty()) return false;
  const std::uint32_t patch = patches_[a.front()];
  const auto is_in_it = [&](std::uint32_t v) { return patches_[v] == patch; };
  return patch != 0 && std::ranges::all_of(a, is_in_it) && std::ranges::all_of(b, is_in_it);
}

}  // namespace warmfront
