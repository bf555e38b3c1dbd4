// SPDX-License-Identifier: Apache-2.0
#include "engine/continuity.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "engine/stencil.h"

namespace warmfront {
namespace {

// Merges two lists that are sorted by `key(list, k)`; `place(list, k)` says which row is the k-th of a list.
template <class Key, class Place>
Continuity merged(std::size_t earlier, std::size_t now, Key key, Place place) {
  Continuity continuity;
  continuity.earlier.assign(now, Continuity::kNew);
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < earlier || j < now) {
    if (j == now || (i < earlier && key(0, i) < key(1, j))) {
      continuity.ended.push_back(place(0, i++));
    } else if (i == earlier || key(1, j) < key(0, i)) {
      ++j;
    } else {
      continuity.earlier[place(1, j++)] = place(0, i++);
    }
  }
  return continuity;
}

/// What makes a row itself. By vertices alone, that of other closest pairs differs in `form`.
struct RowKey {
  std::uint8_t form = 0;
  std::array<std::uint32_t, 4> vertices{};

  friend auto operator<=>(const RowKey&, const RowKey&) = default;
};

RowKey key_of(const RowVertices& rows, std::size_t row) {
  constexpr std::uint8_t kOfHalfSpace = 5;
  if (rows.kind[row] == ContactKind::kVertexHalfSpace) return {kOfHalfSpace, rows.vertices[row]};
  const bool edges = rows.kind[row] != ContactKind::kVertexFace;
  if (rows.stencil.empty() || rows.stencil[row] == 0b1111)
    return {static_cast<std::uint8_t>(edges ? 1 : 0), rows.vertices[row]};
  Stencil pair = stencil_of(rows.kind[row], rows.vertices[row], rows.stencil[row]);
  std::sort(pair.vertices.begin(), pair.vertices.begin() + 2);  // of a vertex pair, or of the edge
  return {pair.size, pair.vertices};
}

struct SortedRows {
  std::vector<RowKey> keys;         // by row
  std::vector<std::size_t> places;  // sorted by key, and by row where these are equal
};

SortedRows sorted(const RowVertices& rows) {
  SortedRows made;
  made.keys.reserve(rows.kind.size());
  for (std::size_t row = 0; row < rows.kind.size(); ++row) made.keys.push_back(key_of(rows, row));
  made.places.resize(made.keys.size());
  std::iota(made.places.begin(), made.places.end(), std::size_t{0});
  std::ranges::sort(made.places, [&](std::size_t x, std::size_t y) {
    return std::tie(made.keys[x], x) < std::tie(made.keys[y], y);
  });
  return made;
}

}  // namespace

Continuity continuity(std::span<const Contact> earlier, std::span<const Contact> now) {
  const std::array lists{earlier, now};
  return merged(
      earlier.size(), now.size(),
      [&](int list, std::size_t k) {
        const Contact& row = lists[list][k];
        return std::tuple(row.kind, row.a, row.b);
      },
      [](int, std::size_t k) { return k; });
}

Continuity continuity(const RowVertices& earlier, const RowVertices& now) {
  const std::array lists{sorted(earlier), sorted(now)};
  Continuity made = merged(
      earlier.kind.size(), now.kind.size(),
      [&](int list, std::size_t k) { return lists[list].keys[lists[list].places[k]]; },
      [&](int list, std::size_t k) { return lists[list].places[k]; });
  std::ranges::sort(made.ended);
  return made;
}

}  // namespace warmfront
