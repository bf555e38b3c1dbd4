// SPDX-License-Identifier: Apache-2.0
// How long a recorded computation would take on any number of cores: a greedy schedule of its pieces (Graham
// 1969), which is never longer than work / cores + span (Brent 1974). Moving a task between cores costs
// nothing here, and memory is as fast for all as for one. Pure functions.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "engine/parallel/fork_trace.h"

namespace warmfront::client {

/// The pieces of a trace, and what waits for what.
class TaskGraph {
 public:
  explicit TaskGraph(std::span<const ForkTrace::Event> events);

  /// Seconds of all pieces; of the longest chain of them, which no number of cores makes shorter.
  double work() const { return work_; }
  double span() const { return span_; }
  /// Seconds on so many cores, each of which takes the piece that has been ready the longest.
  double on_cores(std::size_t cores) const;

  /// A place's share of the longest chain.
  struct Share {
    std::string place;  ///< "after FILE:LINE", serial; "in FILE:LINE", the longest task that is forked there
    double seconds = 0;
  };
  /// The longest chain by place, longest first.
  std::vector<Share> longest_chain() const;

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  struct Piece {
    double seconds = 0;
    std::size_t before = 0;  ///< pieces that must end before it
    std::vector<std::size_t> after;
    std::size_t place = kNone;  ///< in places_
  };

  std::vector<Piece> pieces_;  // each behind those that it waits for
  std::vector<std::string> places_;
  double work_ = 0;
  double span_ = 0;
};

}  // namespace warmfront::client
