// SPDX-License-Identifier: Apache-2.0
// Telling who calls. Thread safety as stated in the header.
#include "server/transport/guard.h"

#include <grpcpp/security/auth_context.h>

#include <algorithm>
#include <string_view>
#include <utility>

namespace warmfront::server {
namespace {

Fault unauthenticated(std::string message) {
  return {ErrorCode::kUnauthenticated, Reason::kUnauthenticated, std::move(message)};
}

}  // namespace

Result<std::unique_ptr<Guard>> Guard::create(Settings settings) {
  std::unique_ptr<Guard> guard(new Guard(std::move(settings)));
  if (const Status loaded = guard->reload(); !loaded) return loaded.error();
  return guard;
}

Status Guard::reload() {
  if (settings_.tls.enabled())
    if (const Status checked = check_tls_files(settings_.tls); !checked) return checked;
  if (settings_.token_file.empty()) return {};
  Result<Tokens> read = Tokens::read(settings_.token_file);
  if (!read) return read.error();
  auto tokens = std::make_shared<const Tokens>(std::move(read).value());
  const MutexLock lock(mutex_);
  tokens_ = std::move(tokens);
  return {};
}

std::shared_ptr<const Tokens> Guard::tokens() const {
  const MutexLock lock(mutex_);
  return tokens_;
}

Outcome<Principal> Guard::identify(const grpc::ServerContextBase& call) const {
  if (!authenticates()) return Principal{{}, true};
  const std::shared_ptr<const Tokens> tokens = this->tokens();
  Outcome<Principal> principal = tokens ? by_token(call, *tokens) : by_certificate(call);
  if (principal && std::ranges::count(settings_.admins, principal.value().name) > 0)
    principal.value().admin = true;
  return principal;
}

Outcome<Principal> Guard::identify_admin(const grpc::ServerContextBase& call) const {
  Outcome<Principal> principal = identify(call);
  if (principal && !principal.value().admin)
    return Fault{ErrorCode::kPermissionDenied, Reason::kPermissionDenied,
                 "principal " + principal.value().name +
                     " is no administrator; name it in --admins or as admin in the token file"};
  return principal;
}

Outcome<Principal> Guard::by_token(const grpc::ServerContextBase& call, const Tokens& tokens) const {
  constexpr std::string_view kScheme = "Bearer ";
  const auto [first, last] = call.client_metadata().equal_range("authorization");
  if (first == last || std::next(first) != last)
    return unauthenticated("the metadata authorization is expected once, as: Bearer TOKEN");
  const std::string_view value(first->second.data(), first->second.size());
  std::optional<Principal> principal;
  if (value.starts_with(kScheme)) principal = tokens.find(value.substr(kScheme.size()));
  if (!principal) return unauthenticated("the token in the metadata authorization is unknown here");
  return *std::move(principal);
}

Outcome<Principal> Guard::by_certificate(const grpc::ServerContextBase& call) const {
  const std::shared_ptr<const grpc::AuthContext> peer = call.auth_context();
  if (peer && peer->IsPeerAuthenticated()) {
    const std::vector<grpc::string_ref> names = peer->GetPeerIdentity();
    if (!names.empty()) return Principal{{names.front().data(), names.front().size()}, false};
  }
  // The handshake demands a certificate of all others.
  if (call.peer().starts_with("unix:")) return Principal{"local", true};
  return unauthenticated("a client certificate with a name in it is expected");
}

}  // namespace warmfront::server
