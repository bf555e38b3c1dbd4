// SPDX-License-Identifier: Apache-2.0
// A fingerprint of answers, so that two ways to compute them can be compared over whole sequences.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/contact.h"

namespace warmfront {

/// 64-bit FNV-1a over, for each step, the number of contacts and each contact's kind, status, a, b and the bits of toi, in
/// order. Equal hashes over a sequence mean the same contacts, bit for bit and in the same order. Not thread-safe.
class ContactHash {
 public:
  void add_step(std::span<const Contact> contacts);
  std::uint64_t value() const { return state_; }
  /// 16 lower-case hexadecimal digits.
  std::string hex() const;

 private:
  void mix(std::uint64_t word);
  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

}  // namespace warmfront
