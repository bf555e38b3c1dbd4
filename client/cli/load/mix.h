// SPDX-License-Identifier: Apache-2.0
// What each session of a load asks, in turn. Plain values and pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/result.h"

namespace warmfront::client::load {

enum class Asked : std::uint8_t { kStep, kTrial, kCommit, kMaxStep, kProximity, kIntersections };
inline constexpr std::array<const char*, 6> kAskedNames{"step",     "trial",     "commit",
                                                        "max_step", "proximity", "intersections"};
inline constexpr std::size_t kAskedKinds = kAskedNames.size();

/// Moves the session to the next frame: a step, or a commit of the trial before it.
inline bool moves(Asked asked) {
  return asked == Asked::kStep || asked == Asked::kCommit;
}

struct Mix {
  std::string text;            ///< as given; empty: steps alone
  std::vector<Asked> cycle{};  ///< asked over and over; empty as the text

  /// The i-th question.
  Asked at(std::size_t i) const { return cycle.empty() ? Asked::kStep : cycle[i % cycle.size()]; }
  bool has(Asked asked) const { return std::ranges::find(cycle, asked) != cycle.end(); }
};

/// Reads NAME=COUNT, each of kAskedNames once at most, like {"trial=3", "commit=1"}. In a cycle the trials
/// and max_steps are dealt evenly to the commits, which they come before (or to the steps, where there are no
/// commits), and the steps come after the commits. Questions about states are dealt likewise and come before
/// all others. kInvalidArgument, saying what is expected, for anything else, and for more commits than there
/// are trials and max_steps to take.
Result<Mix> parse_mix(std::span<const std::string> items);

}  // namespace warmfront::client::load
