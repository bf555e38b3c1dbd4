// SPDX-License-Identifier: Apache-2.0
// The diagrams of a load's report, as inline SVG. Pure functions.
#pragma once

#include <span>
#include <string>

#include "client/cli/load/report.h"

namespace warmfront::client::load {

/// Latency quantiles, one line per point.
std::string plot_quantiles(std::span<const Point> points);
/// p50, p99 and p99.9 against the requested rate, or the number of sessions; empty for fewer than two points.
std::string plot_sweep(const Report& report);
/// Parts of the mean latency, one bar per point.
std::string plot_split(std::span<const Point> points);
/// Frames a second and p99 by time.
std::string plot_series(const Measured& measured);

}  // namespace warmfront::client::load
