// SPDX-License-Identifier: Apache-2.0
// What was found of stationary leaf pairs: it holds in every step until one of the leaves moves. Plain
// values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/contact.h"

namespace warmfront {

/// How many contacts, for whoever asks for no more.
struct ContactTally {
  KindCounts found;
  std::uint64_t possible = 0;  ///< of all but ef
  double earliest = 2;         ///< least toi; 2 without contacts

  std::uint64_t total() const { return found.total(); }
  void add(const ContactTally& more) {
    found.add(more.found);
    possible += more.possible;
    earliest = std::min(earliest, more.earliest);
  }
};

struct RestAnswer {
  std::uint64_t triangle_pairs = 0;  ///< whose bounds overlap
  ContactTally tally;                ///< for Report::kCount; then `contacts` is empty
  std::vector<Contact> contacts;

  bool empty() const { return triangle_pairs == 0 && contacts.empty() && tally.total() == 0; }
  void clear() {
    triangle_pairs = 0;
    tally = {};
    contacts.clear();
  }
  /// What it takes to keep it: the same for any number of threads.
  std::size_t bytes() const { return sizeof(*this) + contacts.size() * sizeof(Contact); }
};

}  // namespace warmfront
