// SPDX-License-Identifier: Apache-2.0
// Telling who calls. Thread safety as stated in the header.
#include "server/auth/guard.h"

#include <grpc/grpc_security_constants.h>
#include <grpcpp/security/auth_context.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <utility>

namespace warmfront::server {
namespace {

constexpr const char* kHow =
    "send one of the daemon's token file in the metadata \"authorization\", once, as \"Bearer TOKEN\" "
    "(our command line: --token-file; our libraries: token_file of Security)";

Fault unauthenticated(std::string message) {
  return {ErrorCode::kUnauthenticated, Reason::kUnauthenticated, std::move(message)};
}

/// By the file system, or from this machine. What a proxy on this machine passes on comes from it, too: ours
/// passes on no administrators' calls.
bool is_from_here(const std::string& peer) {
  return peer.starts_with("unix:") || peer.starts_with("ipv4:127.") || peer.starts_with("ipv6:[::1]") ||
         peer.starts_with("ipv6:%5B::1%5D");
}

/// Kinds of names are kept apart: who may have one certified need not have the others.
std::string name_in(const grpc::AuthContext& peer) {
  constexpr std::array<std::array<const char*, 2>, 5> kKinds{{{"uri:", GRPC_PEER_URI_PROPERTY_NAME},
                                                              {"dns:", GRPC_PEER_DNS_PROPERTY_NAME},
                                                              {"email:", GRPC_PEER_EMAIL_PROPERTY_NAME},
                                                              {"ip:", GRPC_PEER_IP_PROPERTY_NAME},
                                                              {"cn:", GRPC_X509_CN_PROPERTY_NAME}}};
  for (const auto& [kind, property] : kKinds) {
    const std::vector<grpc::string_ref> names = peer.FindPropertyValues(property);
    for (const grpc::string_ref& name : names)
      if (!name.empty()) return std::string(kind).append(name.data(), name.size());
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Guard>> Guard::create(Settings settings) {
  std::unique_ptr<Guard> guard(new Guard(std::move(settings)));
  if (const Status loaded = guard->reload(); !loaded) return loaded.error();
  return guard;
}

Status Guard::reload() {
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

Quotas Guard::quotas() const {
  const std::shared_ptr<const Tokens> tokens = this->tokens();
  return tokens ? tokens->quotas() : Quotas{};
}

std::optional<std::size_t> Guard::token_count() const {
  const std::shared_ptr<const Tokens> tokens = this->tokens();
  return tokens ? std::optional(tokens->size()) : std::nullopt;
}

std::vector<std::string> Guard::without_token(const Quotas& named) const {
  const std::shared_ptr<const Tokens> tokens = this->tokens();
  if (!tokens) return {};
  std::set<std::string> principals(settings_.admins.begin(), settings_.admins.end());
  for (const auto& [principal, quota] : named) principals.insert(principal);
  std::erase_if(principals, [&](const std::string& principal) { return tokens->name(principal); });
  return {principals.begin(), principals.end()};
}

Outcome<Principal> Guard::identify(const grpc::ServerContextBase& call) const {
  if (!authenticates()) return Principal{{}, is_from_here(call.peer())};
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
                 authenticates()
                     ? "principal " + principal.value().name +
                           " is no administrator; name it in --admins or as admin in the token file"
                     : "administrators call from the daemon's own machine where callers are not told apart; "
                       "set --token-file or --tls-client-ca"};
  return principal;
}

Outcome<Principal> Guard::by_token(const grpc::ServerContextBase& call, const Tokens& tokens) const {
  constexpr std::string_view kScheme = "Bearer ";
  const auto [first, last] = call.client_metadata().equal_range("authorization");
  if (first == last || std::next(first) != last)
    return unauthenticated("a token is expected; " + std::string(kHow));
  const std::string_view value(first->second.data(), first->second.size());
  std::optional<Principal> principal;
  if (value.starts_with(kScheme)) principal = tokens.find(value.substr(kScheme.size()));
  if (principal) principal->token = value.substr(kScheme.size());
  if (!principal) return unauthenticated("the token that came is unknown here; " + std::string(kHow));
  return *std::move(principal);
}

Outcome<Principal> Guard::by_certificate(const grpc::ServerContextBase& call) const {
  const std::shared_ptr<const grpc::AuthContext> peer = call.auth_context();
  if (peer && peer->IsPeerAuthenticated()) {
    if (std::string name = name_in(*peer); !name.empty()) return Principal{std::move(name), false};
  }
  // The handshake demands a certificate of all others.
  if (call.peer().starts_with("unix:")) return Principal{"local", true};
  return unauthenticated(
      "a client certificate with a subject alternative name or a common name in it is expected (our clients: "
      "--tls-cert and --tls-key)");
}

Fault Guard::revoked() {
  return unauthenticated(
      "the token in the metadata authorization was valid when the call began, and is not any more");
}

bool Guard::still_knows(const Principal& principal) const {
  const std::shared_ptr<const Tokens> tokens = this->tokens();
  if (!tokens) return true;
  const std::optional<Principal> now = tokens->find(principal.token);
  return now && now->name == principal.name;
}

}  // namespace warmfront::server
