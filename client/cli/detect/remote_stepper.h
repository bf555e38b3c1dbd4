// SPDX-License-Identifier: Apache-2.0
// The stepper behind `--server`: a session of a daemon. Thread safety as stated in stepper.h.
#pragma once

#include <memory>
#include <string>

#include "client/cli/detect/stepper.h"
#include "client/lib/client.h"

namespace warmfront::client {

/// A session on the daemon at `address` (`HOST:PORT` or `unix:PATH`), by `connection`, with `scene` and the
/// positions of frame 0.
Result<std::unique_ptr<Stepper>> make_remote_stepper(const std::string& address,
                                                     const ClientOptions& connection,
                                                     const SceneDescription& scene,
                                                     const Positions& positions,
                                                     const ColliderOptions& options);

}  // namespace warmfront::client
