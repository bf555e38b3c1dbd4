// SPDX-License-Identifier: Apache-2.0
// A session for a verb: see open_session.h.
#include "client/cli/frames/open_session.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "client/cli/server_options.h"

namespace warmfront::client {

Status SessionPlace::check() const {
  if (threads != 0 && !server.empty())
    return invalid_argument("--threads is for this process; with --server the daemon's --threads applies");
  return {};
}

void add_session_place(CLI::App& app, SessionPlace& place) {
  add_server_options(app, place.server, place.connection,
                     "Ask the daemon at this address (HOST:PORT or unix:PATH), not this process", false);
  app.add_option("--threads", place.threads, "Threads in this process; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
}

Result<AnySession> open_session(const SessionPlace& place, const SceneDescription& scene,
                                const Positions& start, const ColliderOptions& options) {
  if (place.server.empty())
    return AnySession::create(scene, start, options, std::make_shared<Workers>(place.threads));
  Result<Client> client = Client::connect(place.server, place.connection);
  if (!client) return client.error();
  Result<Session> session = client.value().create_session(scene, start, options);
  if (!session) return session.error();
  return AnySession(std::move(session).value());
}

}  // namespace warmfront::client
