// SPDX-License-Identifier: Apache-2.0
// Digests: see answer_digest.h.
#include "client/cli/recording/answer_digest.h"

#include <cinttypes>
#include <cstdio>

#include "engine/contact_hash.h"

namespace warmfront::client {

AnswerDigest digest_of(const Answer& answer) {
  ContactHash hash;
  const ContactTable& table = answer.contacts;
  hash.begin_step(table.size());
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table.kind[i] == ContactKind::kEdgeFace)
      hash.add_edge_face(table.status[i], table.edge_faces[i], table.toi[i]);
    else
      hash.add(table.kind[i], table.status[i], table.vertices[i], table.toi[i]);
  }
  hash.add_distances(answer.vertex_distances);
  for (std::size_t i = 0; i < table.multiplicity.size(); ++i) hash.add_closest_pair(table.closest_pair(i));
  return {answer.vf, answer.ee, answer.possible, answer.earliest_toi, hash.value(), answer.vh};
}

AnswerDigest digest_of(const StepAnswer& answer) {
  ContactHash hash;
  hash.begin_step(answer.contacts.size());
  for (const ContactRecord& c : answer.contacts) hash.add(c.kind, c.status, c.vertices, c.toi);
  return {answer.vf, answer.ee, answer.possible, answer.earliest_toi, hash.value(), answer.vh};
}

std::string describe(const AnswerDigest& digest) {
  char toi[64] = "no contact";
  if (digest.earliest_toi) std::snprintf(toi, sizeof toi, "earliest toi %.17g", *digest.earliest_toi);
  char text[256];
  std::snprintf(text, sizeof text,
                "%" PRIu64 " vf, %" PRIu64 " ee, %" PRIu64 " vh, %" PRIu64
                " possible, %s, contacts %016" PRIx64,
                digest.vf, digest.ee, digest.vh, digest.possible, toi, digest.contacts_hash);
  return text;
}

}  // namespace warmfront::client
