// SPDX-License-Identifier: Apache-2.0
// What `load` tells: for people, for programs, for spreadsheets, and as one page with plots. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/load/limits.h"
#include "client/cli/load/measured.h"

namespace warmfront::client::load {

/// A load and how it stands to the limits.
struct Point {
  Measured measured;
  std::vector<Verdict> verdicts;
};

struct Knee {
  std::string limit;             ///< that was searched with
  std::optional<double> rate;    ///< frames a second: the highest tried that held, all lower ones held too
  std::optional<double> failed;  ///< the lowest tried that did not
};

struct Report {
  std::string scene;
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t frames = 0;
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
/// A row a point.
std::string format_csv(const Report& report);
/// One page that needs nothing from elsewhere.
std::string format_html(const Report& report);

}  // namespace warmfront::client::load
