// SPDX-License-Identifier: Apache-2.0
// What the handles of the interface stand for.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "client/c/warmfront.h"
#include "client/lib/local_session.h"

struct wf_flag {
  std::atomic<bool> value{false};
};

struct wf_session {
  wf_session(warmfront::Collider collider, bool single, std::uint32_t given_threads)
      : float32(single),
        threads(given_threads),
        local(std::make_shared<warmfront::client::LocalSession>(
            std::move(collider), single ? warmfront::Rounding::kFloat32 : warmfront::Rounding::kFloat64)) {}

  bool float32;
  std::uint32_t threads;  // as given
  std::shared_ptr<warmfront::client::LocalSession> local;
  // Of the last answer.
  warmfront::client::Answer answer;
  std::vector<std::array<std::uint32_t, 2>> features;
};
