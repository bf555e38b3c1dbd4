// SPDX-License-Identifier: Apache-2.0
#include "client/cli/solve/report.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/cli/print.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

/// Medians over the frames, in ms.
struct Medians {
  double max_step, first_trial, further_trial, commit, frame, step;
};
Medians medians_of(const std::vector<SolveFrame>& frames) {
  std::vector<double> max_step, first, further, commit, all, step;
  for (const SolveFrame& frame : frames) {
    double sum = frame.max_step_ms + frame.commit_ms;
    for (std::size_t i = 0; i < frame.trials.size(); ++i) {
      (i == 0 ? first : further).push_back(frame.trials[i].ms);
      sum += frame.trials[i].ms;
    }
    max_step.push_back(frame.max_step_ms);
    commit.push_back(frame.commit_ms);
    all.push_back(sum);
    if (frame.step_ms) step.push_back(*frame.step_ms);
  }
  return {median(max_step), median(first), median(further), median(commit), median(all), median(step)};
}

}  // namespace

std::string solve_json(const SolveArguments& arguments, const ModelSummary& model,
                       const std::vector<SolveFrame>& frames, const std::string& hash) {
  Json list = Json::array();
  for (const SolveFrame& frame : frames) {
    Json trials = Json::array();
    for (const TrialReport& trial : frame.trials)
      trials.push_back({{"length", trial.length},
                        {"vf", trial.vf},
                        {"ee", trial.ee},
                        {"earliest_toi", trial.earliest_toi ? Json(*trial.earliest_toi) : Json(nullptr)},
                        {"ms", trial.ms}});
    Json one{{"frame", frame.frame}};
    if (frame.max_step) {
      one["max_step"] = *frame.max_step;
      one["max_step_ms"] = frame.max_step_ms;
    }
    one["trials"] = std::move(trials);
    one["commit_ms"] = frame.commit_ms;
    if (frame.step_ms) one["step_ms"] = *frame.step_ms;
    list.push_back(std::move(one));
  }
  const Medians m = medians_of(frames);
  Json medians{{"first_trial", m.first_trial}, {"further_trial", m.further_trial}, {"commit", m.commit}};
  if (arguments.max_step) medians["max_step"] = m.max_step;
  medians["frame"] = m.frame;
  if (arguments.compare) medians["step"] = m.step;
  Json root{{"tier", arguments.tier},
            {"trials", arguments.trials},
            {"shrink", arguments.shrink},
            {"contacts_hash", hash},
            {"median_ms", std::move(medians)}};
  add_to(root, model);
  root["frames"] = std::move(list);
  return root.dump(2) + "\n";
}

void print_solve_frame(const SolveFrame& frame) {
  const TrialReport& first = frame.trials.front();
  const TrialReport& last = frame.trials.back();
  double further = 0;
  for (std::size_t i = 1; i < frame.trials.size(); ++i) further += frame.trials[i].ms;
  if (frame.trials.size() > 1) further /= static_cast<double>(frame.trials.size() - 1);
  const std::string max_step = frame.max_step ? print("%.6f", *frame.max_step) : "-";
  std::printf("%8" PRIu64 " %9s %12" PRIu64 " %12" PRIu64 " %9.4f %10.3f %10.3f %10.3f\n", frame.frame,
              max_step.c_str(), first.vf + first.ee, last.vf + last.ee, last.length, first.ms, further,
              frame.commit_ms);
  std::fflush(stdout);
}

void print_solve_summary(const SolveArguments& arguments, const std::vector<SolveFrame>& frames,
                         const std::string& hash) {
  const Medians m = medians_of(frames);
  std::printf(
      "%zu frames of %s and a commit; medians: first trial %.3f ms, further trial %.3f ms, "
      "commit %.3f ms, ",
      frames.size(), counted(static_cast<std::uint64_t>(arguments.trials), "trial").c_str(), m.first_trial,
      m.further_trial, m.commit);
  if (arguments.max_step) std::printf("max_step %.3f ms, ", m.max_step);
  std::printf("a frame %.3f ms\n", m.frame);
  if (arguments.compare && m.step > 0)
    std::printf(
        "a step to the same places: %.3f ms; first trial %.2f of it, further trial %.2f, a frame "
        "%.2f\n",
        m.step, m.first_trial / m.step, m.further_trial / m.step, m.frame / m.step);
  std::printf("contacts hash %s\n", hash.c_str());
}

}  // namespace warmfront::client
