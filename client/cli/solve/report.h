// SPDX-License-Identifier: Apache-2.0
// The arguments of `solve`, and its report: a row a frame, medians, JSON. Used by the main thread only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/filter_options.h"
#include "client/cli/frames/model_summary.h"
#include "client/cli/frames/open_session.h"
#include "engine/options.h"

namespace warmfront::client {

/// The arguments as given.
struct SolveArguments {
  std::vector<std::string> inputs;
  SessionPlace place;
  std::string tier{to_string(ColliderOptions{}.tier)};
  ColliderOptions options;
  std::string bodies = "declared";
  std::string frames;
  FilterArguments filters;
  int trials = 3;
  double shrink = 0.7;
  bool max_step = false;
  double keep = 0.9;
  std::optional<double> keep_distance;
  bool compare = false;
  std::string json_file;
};

/// One trial: how far towards the frame it went, and what it met.
struct TrialReport {
  double length;
  std::uint64_t vf;
  std::uint64_t ee;
  std::optional<double> earliest_toi;
  double ms;
};
struct SolveFrame {
  std::uint64_t frame;
  std::optional<double> max_step;  ///< with --max-step
  double max_step_ms = 0;
  std::vector<TrialReport> trials;
  double commit_ms = 0;
  std::optional<double> step_ms;  ///< with --compare: of a session that steps to where this one commits
};

/// The whole report, with a line end.
std::string solve_json(const SolveArguments& arguments, const ModelSummary& model,
                       const std::vector<SolveFrame>& frames, const std::string& hash);
void print_solve_frame(const SolveFrame& frame);
void print_solve_summary(const SolveArguments& arguments, const std::vector<SolveFrame>& frames,
                         const std::string& hash);

}  // namespace warmfront::client
