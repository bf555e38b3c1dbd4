// SPDX-License-Identifier: Apache-2.0
// Lists of sessions in pages. A page's token says where it begins and needs no memory of the daemon: the
// session before, by id and principal, which may be gone meanwhile. Thread-safe.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "server/fault.h"
#include "server/session/id.h"
#include "server/session/session.h"

namespace warmfront::server {

/// The token of the page that follows this session: its id, and its principal's name.
inline std::string page_token_after(const Session& session) {
  return session.id().text() + session.owner();
}

/// Calls add(session) for the sessions of a request's page, of all `sessions`, which are in the order of
/// their ids and owners; returns the token of the next page, empty for none. INVALID_ARGUMENT for a negative
/// size or a token of no page.
template <class Request, class Add>
Outcome<std::string> add_page(const std::vector<std::shared_ptr<Session>>& sessions, const Request& request,
                              Add&& add) {
  constexpr std::size_t kIdLength = 36;
  const auto refused = [](std::string message) {
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput, std::move(message)};
  };
  if (request.page_size() < 0)
    return refused("page_size: " + std::to_string(request.page_size()) + " is negative; 0 is for all");
  auto at = sessions.begin();
  if (const std::string& token = request.page_token(); !token.empty()) {
    const Outcome<SessionId> id = SessionId::parse(std::string_view(token).substr(0, kIdLength));
    if (!id)
      return refused("page_token: not the next_page_token of a response; leave it empty for the first page");
    const std::string owner = token.substr(kIdLength);
    at = std::ranges::partition_point(sessions, [&](const std::shared_ptr<Session>& session) {
      return std::tie(session->id(), session->owner()) <= std::tie(id.value(), owner);
    });
  }
  const auto left = static_cast<std::size_t>(sessions.end() - at);
  const auto end = at + static_cast<std::ptrdiff_t>(
                            request.page_size() == 0
                                ? left
                                : std::min<std::size_t>(left, static_cast<std::size_t>(request.page_size())));
  for (; at != end; ++at) add(**at);
  return end == sessions.end() ? std::string() : page_token_after(**std::prev(end));
}

}  // namespace warmfront::server
