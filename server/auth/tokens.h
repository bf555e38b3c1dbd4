// SPDX-License-Identifier: Apache-2.0
// Who may call the daemon, by the secret that they send. Immutable once read, so thread-safe.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/result.h"
#include "server/session/quota.h"

namespace warmfront::server {

/// Who calls. Sessions belong to the principal that made them; an administrator sees and ends those of
/// others, by calls of their own.
struct Principal {
  std::string name;
  bool admin = false;
  std::string token = {};  ///< by which it was identified; empty: by something else. Never logged
};

class Tokens {
 public:
  /// A line is TOKEN PRINCIPAL, then `admin` for an administrator, then a quota's words; blank lines and
  /// those that begin with # mean nothing. A token has at least 16 printable characters, and stands once; a
  /// quota of one principal stands in one line, or is the same in all. INVALID_ARGUMENT names the line, never
  /// what stands in it.
  static Result<Tokens> parse(std::string_view text);
  static Result<Tokens> read(const std::string& path);

  /// Compares with every token, and every character of it, so that the time taken tells nothing but lengths.
  std::optional<Principal> find(std::string_view token) const;
  /// Whether a token is this principal's.
  bool name(std::string_view principal) const;
  std::size_t size() const { return entries_.size(); }
  /// Of those principals of whom something is said.
  const Quotas& quotas() const { return quotas_; }

 private:
  struct Entry {
    std::string token;
    Principal principal;
  };
  std::vector<Entry> entries_;
  Quotas quotas_;
};

}  // namespace warmfront::server
