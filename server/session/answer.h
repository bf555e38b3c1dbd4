// SPDX-License-Identifier: Apache-2.0
// A step's answer, owned and free of the collider that made it. Immutable once made, so free to share between
// threads.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/collider.h"
#include "server/session/account.h"

namespace warmfront::server {

struct Answer {
  std::uint64_t frame = 0;
  std::uint64_t vf = 0;
  std::uint64_t ee = 0;
  std::uint64_t possible = 0;
  std::optional<double> earliest_toi;
  StepStatistics statistics;
  // Columns of equal length, in the engine's order.
  std::vector<std::uint8_t> kind;
  std::vector<std::uint8_t> status;
  std::vector<std::array<std::uint32_t, 4>> vertices;
  std::vector<double> toi;
  /// On the session's account for as long as anyone has the answer: the session, or a stream that sends it.
  Holding memory;

  std::size_t rows() const { return kind.size(); }
  std::size_t memory_bytes() const { return sizeof(*this) + rows() * kBytesPerRow; }

  static constexpr std::size_t kBytesPerRow = 1 + 1 + 16 + 8;  ///< in memory and on the wire
};

Answer make_answer(std::uint64_t frame, const Scene& scene, const StepResult& result);

}  // namespace warmfront::server
