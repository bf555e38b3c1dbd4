// SPDX-License-Identifier: Apache-2.0
// The diagrams of a load's report, as SVG to stand within a page. Pure functions.
#pragma once

#include <span>
#include <string>

#include "client/cli/load/report.h"

namespace warmfront::client::load {

/// Latency by the part of frames that it does not exceed, a line a point.
std::string plot_quantiles(std::span<const Point> points);
/// p50, p99 and p99.9 against the rate asked for, or the number of sessions; empty unless there are two of
/// them.
std::string plot_sweep(const Report& report);
/// Where the mean latency goes, a bar a point.
std::string plot_split(std::span<const Point> points);
/// Frames a second and p99 by time.
std::string plot_series(const Measured& measured);

}  // namespace warmfront::client::load
