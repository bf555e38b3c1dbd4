// SPDX-License-Identifier: Apache-2.0
// A session of a small scene that moves, opened by a client. Thread-safe.
#pragma once

#include <span>
#include <vector>

#include "client/lib/client.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {

/// Of MovingGrids(4), at its frame 0.
inline Result<client::Session> open_grids(client::Client& client) {
  const MovingGrids grids(4);
  const std::vector<double> start = grids.positions(0);
  return client.create_session(grids.scene(), std::span<const double>(start));
}

}  // namespace warmfront::test
