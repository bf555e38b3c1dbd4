// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/topology_checksum.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

// Eight words at a time: sums, and sums of these, as Fletcher's (1982), so that a word's place counts. The
// latter are rotated: else what changes in a high bit would be lost where it counts an even number of times.
struct Sums {
  using Words = std::uint64_t __attribute__((vector_size(64)));
  static constexpr std::size_t kStride = sizeof(Words);
  static constexpr std::size_t kLanes = kStride / sizeof(std::uint64_t);

  Words of_words{};
  Words of_sums{};
};

WARMFRONT_TARGET_CLONES
void add_strides(const unsigned char* bytes, std::size_t count, Sums& to) {
  Sums::Words of_words = to.of_words, of_sums = to.of_sums;
  for (std::size_t i = 0; i < count; ++i) {
    Sums::Words words;
    std::memcpy(&words, bytes + i * Sums::kStride, Sums::kStride);
    of_words += words;
    of_sums = ((of_sums << 9) | (of_sums >> 55)) + of_words;
  }
  to.of_words = of_words;
  to.of_sums = of_sums;
}

/// A word at a time, each position with its own weight (after MurmurHash3's finaliser, Appleby 2011), of the
/// lists' sums and what is left of them.
class Checksum {
 public:
  explicit Checksum(StopSignal stop) : stop_(stop) {}

  template <class T>
  void add(std::span<const T> values) {
    // Bits of doubles count as they are: nobody calculates with them.
    static_assert(sizeof(T) % 4 == 0 &&
                  (std::has_unique_object_representations_v<T> || std::is_same_v<T, double> ||
                   std::is_same_v<T, std::array<double, 4>>));
    add_word(value_, values.size());
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    const std::size_t size = values.size_bytes();
    constexpr std::size_t kAtOnce = 1U << 13;  // strides
    Sums sums;
    const std::size_t strides = size / Sums::kStride;
    for (std::size_t at = 0; at < strides; at += kAtOnce) {
      stop_.check();
      add_strides(bytes + at * Sums::kStride, std::min(kAtOnce, strides - at), sums);
    }
    for (std::size_t at = strides * Sums::kStride; at < size; at += 4) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes + at, 4);
      add_word(value_, word);
    }
    for (std::size_t lane = 0; lane < Sums::kLanes; ++lane) {
      add_word(value_, sums.of_words[lane]);
      add_word(value_, sums.of_sums[lane]);
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
  static void add_word(std::uint64_t& value, std::uint64_t word) {
    value = (value ^ word) * 0xff51afd7ed558ccdULL;
    value ^= value >> 33;
  }
  std::uint64_t value_ = 0;
  StopSignal stop_;
};

// Of a list of numbers less what they begin at.
template <class A, class B>
void add_relative(Checksum& sum, const std::vector<FeatureIds<A, B>>& pairs, A first_a, B first_b) {
  constexpr std::size_t kAtOnce = 256;
  std::array<std::array<std::uint32_t, 2>, kAtOnce> some;
  for (std::size_t at = 0; at < pairs.size(); at += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, pairs.size() - at);
    for (std::size_t i = 0; i < count; ++i) some[i] = {pairs[at + i].a - first_a, pairs[at + i].b - first_b};
    sum.add(std::span<const std::array<std::uint32_t, 2>>(some.data(), count));
  }
}

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

std::uint64_t orphans_checksum(const PartTopology& part, std::size_t index, StopSignal stop) {
  Checksum sum(stop);
  const FeatureRange& features = part.features;
  add_relative(sum, part.orphans.vertex_face, NewVertex{features.first_vertex}, NewFace{part.first_face});
  add_relative(sum, part.orphans.edge_edge, features.first_edge, features.first_edge);
  // Include the part's identity, so that swapping two parts' sets changes the sum.
  sum.add(std::array<std::uint64_t, 1>{index});
  return sum.value();
}

}  // namespace warmfront
