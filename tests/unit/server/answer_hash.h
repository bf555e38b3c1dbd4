// SPDX-License-Identifier: Apache-2.0
// A client library's answer as the hash that the engine's contacts have. Pure function.
#pragma once

#include <cstdint>

#include "client/lib/answer.h"
#include "engine/contact_hash.h"

namespace warmfront::test {

inline void add_to(ContactHash& hash, const client::Answer& answer) {
  const client::ContactTable& contacts = answer.contacts;
  hash.begin_step(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i)
    hash.add(contacts.kind[i], contacts.status[i], contacts.vertices[i], contacts.toi[i]);
}

inline std::uint64_t hash_of(const client::Answer& answer) {
  ContactHash hash;
  add_to(hash, answer);
  return hash.value();
}

}  // namespace warmfront::test
