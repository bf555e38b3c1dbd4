// SPDX-License-Identifier: Apache-2.0
// What a daemon must know to take a session's input, so that one older than it is not asked. Pure functions.
#pragma once

#include <vector>

#include "client/lib/wire.h"
#include "warmfront/v1/collision_service.pb.h"

namespace warmfront::client {

/// What a daemon must know that takes a session.
std::vector<v1::Feature> features_in(const v1::SessionHeader& header);

/// Does a session have what only a daemon with the feature takes?
bool took(const v1::SessionInfo& info, v1::Feature feature);

/// What a daemon without the feature would make of input that needs it, and what to do: kUnimplemented.
RemoteError too_old_for(v1::Feature feature);

}  // namespace warmfront::client
