// SPDX-License-Identifier: Apache-2.0
// Changes of a session's scene that are carried out together; see ChangeSceneRequest on the wire. Used by one
// thread at a time.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "server/fault.h"
#include "server/session/account.h"
#include "server/session/state_digest.h"

namespace warmfront::server {

using warmfront::AddBody;
using warmfront::ChangeBody;
using warmfront::ChangeExcludedPairs;
using warmfront::ChangeFilters;
using warmfront::ReplaceBody;
using warmfront::ReplaceElements;
using warmfront::SceneChange;

struct ChangeOrder {
  std::uint64_t next_frame = 0;
  std::vector<SceneChange> changes;
  std::string key = {};                                 ///< empty: none
  std::optional<SessionState> expected = std::nullopt;  ///< none: whatever the session is in
  std::uint64_t digest = 0;                             ///< of the changes as they were sent
  /// Set when the client has given up; null for one that cannot.
  std::shared_ptr<std::atomic<bool>> given_up = nullptr;
  Holding memory = {};                                    ///< the changes, on the session's account
  std::optional<ColliderOptions> options = std::nullopt;  ///< of the session from then on; none: they stay

  /// The changes are carried out, or never will be.
  void give_back() {
    changes = {};
    memory.set(0);
  }
};

/// Told what becomes of an order, as FrameObserver is of a frame.
class ChangeObserver {
 public:
  ChangeObserver() = default;
  virtual ~ChangeObserver() = default;
  ChangeObserver(const ChangeObserver&) = delete;
  ChangeObserver& operator=(const ChangeObserver&) = delete;

  /// The order's turn has come. Not told of one that is answered again by its key.
  virtual void begins() {}
  /// Exactly once, and last: the state after the changes.
  virtual void answered(const Outcome<SessionState>& outcome) noexcept = 0;
};

}  // namespace warmfront::server
