// SPDX-License-Identifier: Apache-2.0
// A session for a verb, in this process or on a daemon. Used by the main thread only.
#pragma once

#include <string>

#include "client/lib/any_session.h"
#include "client/lib/client.h"

namespace CLI {
class App;
}

namespace warmfront::client {

/// Where a verb's session runs, by its options.
struct SessionPlace {
  std::string server;  ///< empty: in this process, with
  int threads = 0;     ///< so many threads, or one per core
  ClientOptions connection;

  /// kInvalidArgument where options contradict each other.
  Status check() const;
};

/// --server with its connection, and --threads. `place` must outlive the parsing.
void add_session_place(CLI::App& app, SessionPlace& place);

/// Fails as Scene::create() and Collider::create(), or Client::connect() and Client::create_session() do.
Result<AnySession> open_session(const SessionPlace& place, const SceneDescription& scene,
                                const Positions& start, const ColliderOptions& options);

}  // namespace warmfront::client
