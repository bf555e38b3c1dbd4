// SPDX-License-Identifier: Apache-2.0
// A build without the service has no remote stepper, and says so.
#include "client/cli/remote_stepper.h"

namespace warmfront::client {

Result<std::unique_ptr<Stepper>> make_remote_stepper(const std::string& address, const SceneDescription&,
                                                     const Positions&, const ColliderOptions&) {
  return Error{
      ErrorCode::kUnimplemented,
      "--server " + address + ": this build has no client for a daemon; leave --server out to step here"};
}

}  // namespace warmfront::client
