// SPDX-License-Identifier: Apache-2.0
// Output of `load`: for people, for programs, for spreadsheets, and as one page with plots. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/frames/model_summary.h"
#include "client/cli/load/limits.h"
#include "client/cli/load/measured.h"

namespace warmfront::client::load {

/// A load and its verdicts.
struct Point {
  Measured measured;
  std::vector<Verdict> verdicts;
};

struct Knee {
  std::string limit;             ///< the searched limit
  std::optional<double> rate;    ///< frames a second: the highest passed rate below all failed ones
  std::optional<double> failed;  ///< the lowest failed rate
};

struct Report {
  std::string scene;
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t frames = 0;
  ModelSummary model;
  std::string server;
  std::string server_version;
  std::uint32_t server_threads = 0;
  std::vector<Point> points;
  std::optional<Knee> knee;
  bool checked = false;
};

/// One line: how sessions send, for titles and tables.
std::string model_of(const Plan& plan);

std::string format_text(const Report& report);
std::string format_json(const Report& report);
/// One row per point.
std::string format_csv(const Report& report);
/// One self-contained page.
std::string format_html(const Report& report);

}  // namespace warmfront::client::load
