// SPDX-License-Identifier: Apache-2.0
// The door: tells who makes a call, or refuses it. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/annotations.h"
#include "server/auth/tokens.h"
#include "server/fault.h"

namespace warmfront::server {

/// With a token file, the token in the metadata `authorization: Bearer TOKEN` says who calls. Without one,
/// the client's certificate does where a client CA is set: a principal is `uri:`, `dns:`, `email:` or `ip:`
/// and the first subject alternative name of that kind, the first of these kinds that there is, or `cn:` and
/// the common name. One without any of these names is nobody. Over a Unix socket, which has no certificates,
/// the caller is the administrator `local`, whom the file system let in. With neither, all callers are one
/// principal without a name, and those of them on this machine administer the daemon.
class Guard {
 public:
  struct Settings {
    std::string token_file;           ///< empty: none
    bool certificates = false;        ///< clients show one
    std::vector<std::string> admins;  ///< principals that administer, besides those that the token file says
  };

  /// Fails for a token file that cannot be used.
  static Result<std::unique_ptr<Guard>> create(Settings settings);

  /// UNAUTHENTICATED for a call of nobody known.
  Outcome<Principal> identify(const grpc::ServerContextBase& call) const;
  /// The same; PERMISSION_DENIED for one who is no administrator.
  Outcome<Principal> identify_admin(const grpc::ServerContextBase& call) const;

  /// Whether who was identified before would be now, as the same: a token may have been revoked, or given to
  /// another. A certificate counts for as long as its connection.
  bool still_knows(const Principal& principal) const;
  /// What a call of one whom it no longer knows ends with.
  static Fault revoked();

  /// Reads the token file again. On an error what was read before stays in force.
  Status reload();

  /// What the token file says that principals may have.
  Quotas quotas() const;

  /// How many tokens there are; nothing without a token file.
  std::optional<std::size_t> token_count() const;
  /// Those of --admins, and of `named`, who have no token where tokens say who calls.
  std::vector<std::string> without_token(const Quotas& named) const;

  const Settings& settings() const { return settings_; }
  /// Whether callers are told apart.
  bool authenticates() const { return !settings_.token_file.empty() || settings_.certificates; }

 private:
  explicit Guard(Settings settings) : settings_(std::move(settings)) {}
  std::shared_ptr<const Tokens> tokens() const;
  Outcome<Principal> by_token(const grpc::ServerContextBase& call, const Tokens& tokens) const;
  Outcome<Principal> by_certificate(const grpc::ServerContextBase& call) const;

  // Constant after construction.
  const Settings settings_;

  // Protected by mutex_.
  mutable Mutex mutex_;
  std::shared_ptr<const Tokens> tokens_ WARMFRONT_GUARDED_BY(mutex_);  // null: no token file
};

}  // namespace warmfront::server
