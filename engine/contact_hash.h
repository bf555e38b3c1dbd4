// SPDX-License-Identifier: Apache-2.0
// A fingerprint of answers, to compare two computations over whole sequences.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "engine/contact.h"
#include "engine/scene.h"

namespace warmfront {

/// 64-bit FNV-1a over, for each step, the number of contacts and each contact's kind, status, four vertices
/// (as Scene::vertices_of gives them) and the bits of toi, in order. Equal hashes over a sequence mean the
/// same contacts, bit for bit and in the same order; of an edge and a face that meet all five vertices count,
/// and of an answer by vertex its numbers, and of a reduced one what each row stands for. Not thread-safe.
class ContactHash {
 public:
  void add_step(const Scene& scene, std::span<const Contact> contacts);

  /// The same piece by piece, for answers from the wire: begin_step() per step, then add() per contact.
  void begin_step(std::uint64_t contact_count);
  void add(ContactKind kind, ContactStatus status, const std::array<std::uint32_t, 4>& vertices, double toi);
  void add_edge_face(ContactStatus status, const std::array<std::uint32_t, 5>& vertices, double toi);
  void add_distances(std::span<const double> distances);
  /// Of a row of a reduced answer, after all its rows.
  void add_closest_pair(const ClosestPair& pair);

  std::uint64_t value() const { return state_; }
  /// 16 lower-case hexadecimal digits.
  std::string hex() const;

 private:
  void mix(std::uint64_t word);
  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

}  // namespace warmfront
