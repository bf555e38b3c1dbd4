// SPDX-License-Identifier: Apache-2.0
#include "engine/contact_hash.h"

#include <bit>
#include <cstdio>

namespace warmfront {

void ContactHash::mix(std::uint64_t word) {
  for (int byte = 0; byte < 8; ++byte) {
    state_ = (state_ ^ ((word >> (8 * byte)) & 0xff)) * 0x100000001b3ULL;
  }
}

void ContactHash::begin_step(std::uint64_t contact_count) {
  mix(contact_count);
}

void ContactHash::add(ContactKind kind, ContactStatus status, const std::array<std::uint32_t, 4>& vertices,
                      double toi) {
  mix((static_cast<std::uint64_t>(kind) << 8) | static_cast<std::uint64_t>(status));
  mix((static_cast<std::uint64_t>(vertices[0]) << 32) | vertices[1]);
  mix((static_cast<std::uint64_t>(vertices[2]) << 32) | vertices[3]);
  mix(std::bit_cast<std::uint64_t>(toi));
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

std::string ContactHash::hex() const {
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(state_));
  return digits;
}

}  // namespace warmfront
