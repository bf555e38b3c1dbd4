// SPDX-License-Identifier: Apache-2.0
#include "tests/support/reduced_oracle.h"

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "engine/elementary/contact_geometry.h"
#include "tests/support/brute_force.h"

namespace warmfront::testing {
namespace {

using Long3 = std::array<long double, 3>;

Long3 between(const VertexMotion& from, const VertexMotion& to, bool at_end) {
  Long3 way;
  for (int k = 0; k < 3; ++k)
    way[k] = at_end ? static_cast<long double>(to.t1[k]) - from.t1[k]
                    : static_cast<long double>(to.t0[k]) - from.t0[k];
  return way;
}

long double dot(const Long3& a, const Long3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

bool nearly_parallel(const FeatureVertices& four, bool at_end) {
  const Long3 a = between(*four.vertex[0], *four.vertex[1], at_end);
  const Long3 b = between(*four.vertex[2], *four.vertex[3], at_end);
  const Long3 n{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  return dot(n, n) < 1e-3L * dot(a, a) * dot(b, b);
}

}  // namespace

ReducedOracle reduced_oracle(const Scene& scene, std::span<const VertexMotion> vertices,
                             std::span<const Contact> all) {
  ReducedOracle reduced;
  std::map<std::vector<std::uint32_t>, std::size_t>
      first;  // kept row by sorted vertices, the single one last
  for (const Contact& contact : all) {
    if (contact.kind == ContactKind::kVertexHalfSpace) {  // which no other row is like
      reduced.contacts.push_back(contact);
      reduced.closest_pairs.push_back({1, 0b0001});
      continue;
    }
    const FeatureVertices four = features_of(scene, vertices, contact.kind, contact.a, contact.b);
    const std::array<double, 4> weights = contact_geometry(contact.kind, four.vertex, contact.toi).weights;
    const bool edges = contact.kind != ContactKind::kVertexFace;
    const bool own = contact.kind == ContactKind::kEdgeEdge && nearly_parallel(four, contact.toi == 1);
    const auto ids = scene.vertices_of(contact);
    ClosestPair pair{1, 0};
    std::array<std::vector<std::uint32_t>, 2> sides;
    for (int k = 0; k < 4; ++k) {
      if (weights[k] == 0 && !own) continue;
      pair.stencil = static_cast<std::uint8_t>(pair.stencil | 1 << k);
      sides[k < (edges ? 2 : 1) ? 0 : 1].push_back(ids[k]);
    }
    std::vector<std::uint32_t> key;
    if (pair.stencil != 15) {
      for (auto& side : sides) std::ranges::sort(side);
      std::ranges::sort(sides, [](const auto& x, const auto& y) {
        return x.size() != y.size() ? x.size() > y.size() : x < y;
      });
      for (const auto& side : sides) key.insert(key.end(), side.begin(), side.end());
      if (const auto known = first.find(key); known != first.end()) {
        ++reduced.closest_pairs[known->second].multiplicity;
        continue;
      }
      first.emplace(key, reduced.contacts.size());
    }
    reduced.contacts.push_back(contact);
    reduced.closest_pairs.push_back(pair);
  }
  return reduced;
}

}  // namespace warmfront::testing
