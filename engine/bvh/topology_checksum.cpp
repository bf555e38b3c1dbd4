// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/topology_checksum.h"

#include <array>
#include <bit>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace warmfront {
namespace {

/// A word at a time, each position with its own weight (after MurmurHash3's finaliser, Appleby 2011).
class Checksum {
 public:
  explicit Checksum(StopSignal stop) : paced_(stop, 1U << 16) {}

  template <class T>
  void add(std::span<const T> values) {
    // Bits of doubles count as they are: nobody calculates with them.
    static_assert(sizeof(T) % 4 == 0 &&
                  (std::has_unique_object_representations_v<T> || std::is_same_v<T, double> ||
                   std::is_same_v<T, std::array<double, 4>>));
    add_word(values.size());
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    for (std::size_t at = 0; at < values.size_bytes(); at += 4) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes + at, 4);
      add_word(word);
      paced_.check();
    }
  }
  template <class T>
  void add(const std::vector<T>& values) {
    add(std::span<const T>(values));
  }
  template <class T, std::size_t N>
  void add(const std::array<T, N>& values) {
    add(std::span<const T>(values));
  }
  void add(const Csr& lists) {
    add(lists.begin);
    add(lists.items);
  }
  void add(const Scene& scene) {
    add(scene.faces());
    add(scene.edges());
    add(scene.face_edges());
    add(scene.vertex_faces());
    add(scene.edge_faces());
    add(scene.lone_edges());
    add(scene.isolated_vertices());
    add(scene.body_of_vertex());
  }
  std::uint64_t value() const { return value_; }

 private:
  void add_word(std::uint64_t word) {
    value_ = (value_ ^ word) * 0xff51afd7ed558ccdULL;
    value_ ^= value_ >> 33;
  }
  std::uint64_t value_ = 0;
  PacedStop paced_;
};

}  // namespace

std::uint64_t topology_checksum(const Scene& given, const Topology& topology, StopSignal stop) {
  Checksum sum(stop);
  sum.add(given);
  sum.add(topology.scene);
  sum.add(topology.numbering.given_vertices());
  for (const PartTopology& part : topology.parts) sum.add(part.order);
  return sum.value();
}

std::uint64_t filter_checksum(const PairFilter& filter, StopSignal stop) {
  if (!filter.any()) return 0;
  Checksum sum(stop);
  sum.add(filter.excluded_vertices().begin());
  sum.add(filter.excluded_vertices().items());
  sum.add(filter.patches());
  sum.add(filter.rest_shape());
  sum.add(std::array{std::bit_cast<std::uint64_t>(filter.rest_distance())});
  return sum.value();
}

std::uint64_t thickness_checksum(const Thickness& thickness, StopSignal stop) {
  if (!thickness.any()) return 0;
  Checksum sum(stop);
  sum.add(thickness.of_vertices());
  sum.add(thickness.of_parts());
  return sum.value();
}

std::uint64_t orphans_checksum(const PartTopology& part, StopSignal stop) {
  Checksum sum(stop);
  sum.add(part.orphans.vertex_face);
  sum.add(part.orphans.edge_edge);
  // Include the part's identity, so that swapping two parts' sets changes the sum.
  sum.add(std::array<std::uint32_t, 2>{part.features.first_vertex, part.features.first_edge});
  return sum.value();
}

}  // namespace warmfront
