// SPDX-License-Identifier: Apache-2.0
// The edges of a scene by their own type. A Scene, which the user sees, lists them as plain numbers: these
// become EdgeIds here. Pure functions.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>

#include "engine/scene.h"
#include "engine/scene/numbers.h"

namespace warmfront {

/// Its two vertices.
inline const Edge& ends_of(const Scene& scene, EdgeId edge) {
  return scene.edges()[number_of(edge)];
}
/// As Scene::edge_faces().
inline std::span<const std::uint32_t> faces_along(const Scene& scene, EdgeId edge) {
  return scene.edge_faces()[number_of(edge)];
}

/// As Scene::face_edges().
inline EdgeId side_of(const Scene& scene, std::uint32_t face, int side) {
  return EdgeId{scene.face_edges()[face][side]};
}
inline std::array<EdgeId, 3> sides_of(const Scene& scene, std::uint32_t face) {
  const auto [a, b, c] = scene.face_edges()[face];
  return {EdgeId{a}, EdgeId{b}, EdgeId{c}};
}

/// Edges of a list of the scene's, which outlives this. (A view of the standard library's would be one, were
/// there no clang 14.)
class EdgeList {
 public:
  class Iterator {
   public:
    using value_type = EdgeId;
    using difference_type = std::ptrdiff_t;
    using reference = EdgeId;
    using pointer = void;
    using iterator_category = std::random_access_iterator_tag;

    Iterator() = default;
    explicit Iterator(const std::uint32_t* at) : at_(at) {}
    EdgeId operator*() const { return EdgeId{*at_}; }
    EdgeId operator[](difference_type n) const { return EdgeId{at_[n]}; }
    Iterator& operator++() { return *this += 1; }
    Iterator operator++(int) { return Iterator(at_++); }
    Iterator& operator--() { return *this += -1; }
    Iterator operator--(int) { return Iterator(at_--); }
    Iterator& operator+=(difference_type n) {
      at_ += n;
      return *this;
    }
    Iterator& operator-=(difference_type n) { return *this += -n; }
    friend Iterator operator+(Iterator i, difference_type n) { return i += n; }
    friend Iterator operator+(difference_type n, Iterator i) { return i += n; }
    friend Iterator operator-(Iterator i, difference_type n) { return i -= n; }
    friend difference_type operator-(Iterator a, Iterator b) { return a.at_ - b.at_; }
    friend auto operator<=>(const Iterator&, const Iterator&) = default;

   private:
    const std::uint32_t* at_ = nullptr;
  };

  explicit EdgeList(std::span<const std::uint32_t> numbers) : numbers_(numbers) {}
  Iterator begin() const { return Iterator(numbers_.data()); }
  Iterator end() const { return begin() + static_cast<std::ptrdiff_t>(numbers_.size()); }
  std::size_t size() const { return numbers_.size(); }
  bool empty() const { return numbers_.empty(); }
  EdgeId operator[](std::size_t i) const { return EdgeId{numbers_[i]}; }
  EdgeId front() const { return EdgeId{numbers_.front()}; }

 private:
  std::span<const std::uint32_t> numbers_;
};
inline EdgeList lone_edges(const Scene& scene) {
  return EdgeList(scene.lone_edges());
}
inline EdgeList lone_edges_of(const Scene& scene, std::uint32_t vertex) {
  return EdgeList(scene.lone_edges_of(vertex));
}

/// A range of vertices and of edges, for example of a body.
struct FeatureRange {
  std::uint32_t first_vertex = 0;
  std::uint32_t end_vertex = 0;
  EdgeId first_edge{0};
  EdgeId end_edge{0};
};

inline FeatureRange whole(const Scene& scene) {
  return {0, scene.vertex_count(), EdgeId{0}, EdgeId{scene.edge_count()}};
}
/// Vertices [first, end) and the edges between them, which are a range when the vertices are a body's.
FeatureRange features_of(const Scene& scene, std::uint32_t first_vertex, std::uint32_t end_vertex);

}  // namespace warmfront
