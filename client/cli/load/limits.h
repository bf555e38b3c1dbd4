// SPDX-License-Identifier: Apache-2.0
// The limits of a load. Pure functions and values.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/load/measured.h"
#include "engine/result.h"

namespace warmfront::client::load {

struct Limited;  // what can be limited: a name, its unit, where it stands, and which side of the limit is
                 // good

struct Limit {
  const Limited* what = nullptr;
  double value = 0;  ///< in the unit of `what`

  /// "p99=20ms", in the syntax of parse_limit().
  std::string text() const;
};

/// Reads NAME=VALUE: a time in us, ms or s (p50, p90, p99, p99.9, max, mean, cold-max, late-p99), a count
/// (errors, reconnects, rebuilds, different, unsent) or a rate (frames-per-second), which is a minimum; the
/// others are maxima. Errors list the names.
Result<Limit> parse_limit(std::string_view text);
/// The names of all limits, for help.
std::string limit_names();

struct Verdict {
  Limit limit;
  double measured = 0;
  bool kept = false;

  /// "missed p99=20ms by 3.1 ms (23.1 ms)" or "kept p99=20ms (12.0 ms)".
  std::string text() const;
};
/// A load without any measured frame misses every limit on a time.
Verdict judge(const Limit& limit, const Measured& measured);
std::vector<Verdict> judge(std::span<const Limit> limits, const Measured& measured);
bool all_kept(std::span<const Verdict> verdicts);

}  // namespace warmfront::client::load
