// SPDX-License-Identifier: Apache-2.0
// What a frame has with it from its arrival until it is computed. Used by one thread at a time.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "server/fault.h"
#include "server/session/account.h"
#include "server/session/gate.h"
#include "server/session/tenants.h"

namespace warmfront::server {

/// A stream that holds a session, or held it; numbered upwards, per session.
enum class Attachment : std::uint64_t {};

struct FramePass {
  std::optional<Gate::Ticket> ticket;  ///< its place among the daemon's frames in flight
  Holding memory;                      ///< its positions, on the session's account
  /// Set when the client has given up, or the session was closed; null for a frame whose client cannot give
  /// it up.
  std::shared_ptr<std::atomic<bool>> given_up;
  /// The stream that it came over; none for a unary call's.
  std::optional<Attachment> attachment;
  std::optional<Fault> refused;  ///< the frame's answer, in its turn, instead of a step
  /// Bytes of contacts that can be told to who asks: a frame whose answer would have more is refused, and
  /// does not count.
  std::size_t max_answer_bytes = std::numeric_limits<std::size_t>::max();

  /// Its positions turned out to take so much: pieces of a frame have more room than they use.
  void hold(std::size_t bytes) {
    if (bytes > memory.bytes()) memory.set(bytes);
  }
  /// The frame is computed: it takes no one's place any more.
  void give_back() {
    ticket.reset();
    memory.set(0);
  }
  bool cancelled() const { return given_up && given_up->load(std::memory_order_relaxed); }
};

/// A pass for a frame whose positions take `bytes`; refused when the tenant's gate, or the daemon's around
/// it, lets no more in.
inline FramePass admit_frame(Gate& of_tenant, const Gate& of_daemon, std::shared_ptr<Account> account,
                             std::size_t bytes) {
  FramePass pass{of_tenant.enter(), Holding(std::move(account), bytes), nullptr, std::nullopt, std::nullopt};
  if (!pass.ticket)
    pass.refused = gate_met(of_tenant, of_daemon, "", "frames in flight", "max-frames-in-flight",
                            "max-frames-per-principal");
  return pass;
}

}  // namespace warmfront::server
