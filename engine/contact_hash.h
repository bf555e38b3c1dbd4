// SPDX-License-Identifier: Apache-2.0
// A fingerprint of answers, to compare two computations over whole sequences.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "engine/contact.h"
#include "engine/scene.h"

namespace warmfront {

/// 64-bit FNV-1a over, for each step, the number of contacts and each contact's kind, status, four vertices
/// (as Scene::vertices_of gives them) and the bits of toi, in order. Equal hashes over a sequence mean the
/// same contacts, bit for bit and in the same order; of an edge and a face that meet all five vertices count,
/// and of an answer by vertex its numbers, and of a reduced one what each row stands for. Not thread-safe.
class ContactHash {
 public:
  ContactHash() = default;
  /// Goes on from what another hash was at, by its value().
  explicit ContactHash(std::uint64_t value) : state_(value) {}

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

/// What a part of a sequence makes of a ContactHash, whatever came before it: parts that are computed apart,
/// in any order, give the hash of the whole. Each byte takes FNV-1a from h to (h xor byte) p, and the
/// exclusive or changes nothing but the low byte of h. So of two hashes with the same low byte, h and h + 256
/// q, the second is (h xor byte) p + 256 q p after it: the low bytes are equal again, and the difference was
/// multiplied by p. A part is therefore known by where it takes the hashes 0 to 255, and by p to the power of
/// its number of bytes. Takes 256 times the arithmetic of a ContactHash, vectorised. Not thread-safe.
class ContactHashPart {
 public:
  ContactHashPart();

  /// As those of ContactHash.
  void begin_step(std::uint64_t contact_count);
  void add(ContactKind kind, ContactStatus status, const std::array<std::uint32_t, 4>& vertices, double toi);

  /// The value of a hash that was at `before` where this part begins, where it ends.
  std::uint64_t after(std::uint64_t before) const {
    return ends_[before & 0xff] + (before & ~std::uint64_t{0xff}) * power_;
  }
  /// Becomes this part and then `next`.
  void append(const ContactHashPart& next);

  /// 4,112 lower-case hexadecimal digits, from which parse() makes the same part; nothing for any other text.
  std::string text() const;
  static std::optional<ContactHashPart> parse(std::string_view text);

 private:
  std::array<std::uint64_t, 256> ends_;  // of a hash that is 0 to 255 where the part begins
  std::uint64_t power_ = 1;
};

}  // namespace warmfront
