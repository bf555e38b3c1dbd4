// SPDX-License-Identifier: Apache-2.0
#include "engine/contact_hash.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdio>

#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

constexpr std::uint64_t kPrime = 0x100000001b3ULL;

/// The words of a contact, byte by byte from the lowest of the first.
std::array<std::uint64_t, 4> words_of(ContactKind kind, ContactStatus status,
                                      const std::array<std::uint32_t, 4>& vertices, double toi) {
  return {(static_cast<std::uint64_t>(kind) << 8) | static_cast<std::uint64_t>(status),
          (static_cast<std::uint64_t>(vertices[0]) << 32) | vertices[1],
          (static_cast<std::uint64_t>(vertices[2]) << 32) | vertices[3], std::bit_cast<std::uint64_t>(toi)};
}

constexpr int kWordBytes = 8;

/// The prime to the power of 0 to 8.
constexpr auto kPowers = [] {
  std::array<std::uint64_t, kWordBytes + 1> powers{1};
  for (std::size_t i = 1; i < powers.size(); ++i) powers[i] = powers[i - 1] * kPrime;
  return powers;
}();

/// Mixes a word into each hash. Bytes that are 0 only multiply, so that a run of them is one product.
WARMFRONT_TARGET_CLONES
void mix_into_all(std::array<std::uint64_t, 256>& hashes, std::uint64_t word) {
  for (int byte = 0; byte < kWordBytes;) {
    const std::uint64_t value = (word >> (8 * byte)) & 0xff;
    int bytes = 1;
    while (byte + bytes < kWordBytes && ((word >> (8 * (byte + bytes))) & 0xff) == 0) ++bytes;
    const std::uint64_t power = kPowers[static_cast<std::size_t>(bytes)];
    for (std::uint64_t& hash : hashes) hash = (hash ^ value) * power;
    byte += bytes;
  }
}

}  // namespace

void ContactHash::mix(std::uint64_t word) {
  for (int byte = 0; byte < kWordBytes; ++byte) {
    state_ = (state_ ^ ((word >> (8 * byte)) & 0xff)) * kPrime;
  }
}

void ContactHash::begin_step(std::uint64_t contact_count) {
  mix(contact_count);
}

void ContactHash::add(ContactKind kind, ContactStatus status, const std::array<std::uint32_t, 4>& vertices,
                      double toi) {
  for (const std::uint64_t word : words_of(kind, status, vertices, toi)) mix(word);
}

void ContactHash::add_step(const Scene& scene, std::span<const Contact> contacts) {
  begin_step(contacts.size());
  for (const Contact& contact : contacts) {
    if (contact.kind == ContactKind::kEdgeFace)
      add_edge_face(contact.status, scene.edge_face_vertices_of(contact), contact.toi);
    else
      add(contact.kind, contact.status, scene.vertices_of(contact), contact.toi);
  }
}

void ContactHash::add_edge_face(ContactStatus status, const std::array<std::uint32_t, 5>& vertices,
                                double toi) {
  add(ContactKind::kEdgeFace, status, {vertices[0], vertices[1], vertices[2], vertices[3]}, toi);
  mix(vertices[4]);
}

void ContactHash::add_distances(std::span<const double> distances) {
  for (const double distance : distances) mix(std::bit_cast<std::uint64_t>(distance));
}

void ContactHash::add_closest_pair(const ClosestPair& pair) {
  mix(std::uint64_t{pair.stencil} << 32 | pair.multiplicity);
}

namespace {

constexpr std::size_t kDigits = 16;  // of a word

std::string in_hex(std::uint64_t word) {
  std::array<char, kDigits + 1> digits;
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(word));
  return {digits.data(), kDigits};
}

}  // namespace

std::string ContactHash::hex() const {
  return in_hex(state_);
}

ContactHashPart::ContactHashPart() {
  for (std::size_t low = 0; low < ends_.size(); ++low) ends_[low] = low;
}

void ContactHashPart::begin_step(std::uint64_t contact_count) {
  mix_into_all(ends_, contact_count);
  power_ *= kPowers.back();
}

void ContactHashPart::add(ContactKind kind, ContactStatus status,
                          const std::array<std::uint32_t, 4>& vertices, double toi) {
  for (const std::uint64_t word : words_of(kind, status, vertices, toi)) {
    mix_into_all(ends_, word);
    power_ *= kPowers.back();
  }
}

void ContactHashPart::append(const ContactHashPart& next) {
  for (std::uint64_t& end : ends_) end = next.after(end);
  power_ *= next.power_;
}

std::string ContactHashPart::text() const {
  std::string digits;
  for (const std::uint64_t end : ends_) digits += in_hex(end);
  return digits + in_hex(power_);
}

std::optional<ContactHashPart> ContactHashPart::parse(std::string_view text) {
  ContactHashPart part;
  if (text.size() != (part.ends_.size() + 1) * kDigits) return std::nullopt;
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  if (!std::ranges::all_of(text, is_digit)) return std::nullopt;
  const auto word = [text](std::size_t index) {
    std::uint64_t value = 0;
    const char* const first = text.data() + index * kDigits;
    std::from_chars(first, first + kDigits, value, 16);
    return value;
  };
  for (std::size_t low = 0; low < part.ends_.size(); ++low) part.ends_[low] = word(low);
  part.power_ = word(part.ends_.size());
  return part;
}

}  // namespace warmfront
