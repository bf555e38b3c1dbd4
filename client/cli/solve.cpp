// SPDX-License-Identifier: Apache-2.0
// The verb `solve`: see solve.h.
#include "client/cli/solve.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/cli/filter_options.h"
#include "client/cli/frame_model.h"
#include "client/cli/frame_steps.h"
#include "client/cli/model_summary.h"
#include "client/cli/open_session.h"
#include "client/cli/print.h"
#include "client/cli/progress.h"
#include "client/io/file.h"
#include "client/io/input.h"
#include "engine/contact_hash.h"
#include "engine/part_way.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

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

Status check_usage(SolveArguments& arguments) {
  if (Status status = check_input_arguments(arguments.inputs); !status) return status;
  const Result<Tier> tier = parse_tier(arguments.tier);
  if (!tier) return tier.error();
  arguments.options.tier = tier.value();
  if (const Result<BodiesMode> bodies = parse_bodies_mode(arguments.bodies); !bodies) return bodies.error();
  if (Status status = arguments.place.check(); !status) return status;
  ColliderOptions asked = arguments.options;
  asked.keep_distance = arguments.keep_distance;
  return validate(asked);
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

/// Calls `work`; how long it took is written to `ms`.
template <class Work>
auto timed(double& ms, Work work) {
  const auto start = std::chrono::steady_clock::now();
  auto result = work();
  ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return result;
}

/// A line search a frame: stands at X, asks along X to the frame, and commits the shortest trial.
template <class Number>
class LineSearch {
 public:
  LineSearch(const SolveArguments& arguments, AnySession session, std::optional<AnySession> beside,
             std::span<const Number> start)
      : arguments_(arguments),
        session_(std::move(session)),
        beside_(std::move(beside)),
        at_(start.begin(), start.end()) {}

  Result<SolveFrame> frame(std::uint64_t number, std::span<const Number> there) {
    SolveFrame report{number, {}, 0, {}, 0, {}};
    double length = 1;
    if (arguments_.max_step) {
      const Result<MaxStep> far = timed(report.max_step_ms, [&] {
        return session_.max_step(Frame{there}, true, {.keep_distance = arguments_.keep_distance});
      });
      if (!far) return far.error();
      report.max_step = far.value().fraction;
      if (far.value().fraction < 1) length = arguments_.keep * far.value().fraction;
    }
    for (int trial = 0; trial < arguments_.trials; ++trial, length *= arguments_.shrink) {
      go(there, length);
      TrialReport told{length, 0, 0, {}, 0};
      const Result<Answer> answer =
          timed(told.ms, [&] { return session_.trial(Frame{std::span<const Number>(trial_)}); });
      if (!answer) return answer.error();
      told.vf = answer.value().vf;
      told.ee = answer.value().ee;
      told.earliest_toi = answer.value().earliest_toi;
      add(answer.value().contacts);
      report.trials.push_back(told);
    }
    const Result<CommitResult> committed = timed(report.commit_ms, [&] { return session_.commit(); });
    if (!committed) return committed.error();
    at_.swap(trial_);
    if (beside_) {
      double ms = 0;
      const Result<Answer> step =
          timed(ms, [&] { return beside_->step(Frame{std::span<const Number>(at_)}); });
      if (!step) return step.error();
      report.step_ms = ms;
    }
    return report;
  }

  std::string hash() const { return hash_.hex(); }

 private:
  void go(std::span<const Number> there, double length) {
    constexpr bool kSingle = std::is_same_v<Number, float>;
    trial_.resize(at_.size());
    for (std::size_t i = 0; i < at_.size(); ++i)
      trial_[i] = static_cast<Number>(part_way(at_[i], there[i], length, kSingle));
  }
  void add(const ContactTable& contacts) {
    hash_.begin_step(contacts.size());
    for (std::size_t i = 0; i < contacts.size(); ++i)
      hash_.add(contacts.kind[i], contacts.status[i], contacts.vertices[i], contacts.toi[i]);
  }

  const SolveArguments& arguments_;
  AnySession session_;
  std::optional<AnySession> beside_;
  std::vector<Number> at_;     // where the session stands
  std::vector<Number> trial_;  // where the last trial went
  ContactHash hash_;
};

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

Json format_json(const SolveArguments& arguments, const ModelSummary& model,
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
  return root;
}

void print_frame(const SolveFrame& frame) {
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

void print_summary(const SolveArguments& arguments, const std::vector<SolveFrame>& frames,
                   const std::string& hash) {
  const Medians m = medians_of(frames);
  std::printf(
      "%zu frames of %d trial%s and a commit; medians: first trial %.3f ms, further trial %.3f ms, "
      "commit %.3f ms, ",
      frames.size(), arguments.trials, arguments.trials == 1 ? "" : "s", m.first_trial, m.further_trial,
      m.commit);
  if (arguments.max_step) std::printf("max_step %.3f ms, ", m.max_step);
  std::printf("a frame %.3f ms\n", m.frame);
  if (arguments.compare && m.step > 0)
    std::printf(
        "a step to the same places: %.3f ms; first trial %.2f of it, further trial %.2f, a frame "
        "%.2f\n",
        m.step, m.first_trial / m.step, m.further_trial / m.step, m.frame / m.step);
  std::printf("contacts hash %s\n", hash.c_str());
}

template <class Number>
int play(const SolveArguments& arguments, FrameSteps& steps, const SceneDescription& scene,
         std::span<const Number> start) {
  Result<AnySession> session = open_session(arguments.place, scene, start, arguments.options);
  if (!session) return failure(session.error().message);
  std::optional<AnySession> beside;
  if (arguments.compare) {
    Result<AnySession> second = open_session(arguments.place, scene, start, arguments.options);
    if (!second) return failure(second.error().message);
    beside.emplace(std::move(second).value());
  }
  LineSearch<Number> search(arguments, std::move(session).value(), std::move(beside), start);
  const bool table = arguments.json_file != "-";
  if (table)
    std::printf("%8s %9s %12s %12s %9s %10s %10s %10s\n", "frame", "max step", "contacts", "at the last",
                "length", "first ms", "further", "commit");
  std::vector<SolveFrame> frames;
  Progress progress("frame", steps.step_count());
  for (std::uint64_t step = 1; step <= steps.step_count(); ++step) {
    if (Status status = steps.next(); !status) return failure(status.error().message);
    Result<SolveFrame> frame = search.frame(steps.number(), std::get<std::span<const Number>>(steps.end()));
    if (!frame) return failure("frame " + std::to_string(steps.number()) + ": " + frame.error().message);
    frames.push_back(std::move(frame).value());
    if (table) {
      progress.clear();
      print_frame(frames.back());
    }
    progress.update(step);
  }
  progress.clear();
  if (!arguments.json_file.empty()) {
    const std::string text = format_json(arguments, summary_of(scene), frames, search.hash()).dump(2) + "\n";
    if (Status status = write_text(arguments.json_file, text); !status)
      return failure(status.error().message);
  }
  if (table) print_summary(arguments, frames, search.hash());
  return finish_output();
}

int solve(SolveArguments arguments) {
  if (Status status = check_usage(arguments); !status) return usage_error(status.error().message);
  if (Status status = check_writable(std::array{arguments.json_file}); !status)
    return failure(status.error().message);
  Result<std::unique_ptr<Input>> opened = open_input(arguments.inputs);
  if (!opened) return failure(opened.error().message);
  Input& input = *opened.value();
  print_notes(input.notes());
  FrameRange range{0, input.frame_count() - 1};
  if (!arguments.frames.empty()) {
    const Result<FrameRange> parsed = parse_frame_range(arguments.frames, input.frame_count());
    if (!parsed) return usage_error(parsed.error().message);
    range = parsed.value();
  }
  Result<FrameSteps> steps = FrameSteps::open(input, range, 1);
  if (!steps) return failure(steps.error().message);
  Result<SceneDescription> scene = with_bodies(input.scene(), parse_bodies_mode(arguments.bodies).value());
  if (!scene) return failure(scene.error().message);
  if (Status status = take_filters(arguments.filters, input, scene.value()); !status)
    return failure(status.error().message);
  return std::visit([&](auto start) { return play(arguments, steps.value(), scene.value(), start); },
                    steps.value().end());
}

}  // namespace

Verb add_solve(CLI::App& app) {
  auto arguments = std::make_shared<SolveArguments>();
  SolveArguments& a = *arguments;
  app.add_option(
         "INPUT", a.inputs,
         "A folder with mesh.ply and frames.pc2, or t0.ply, t1.ply, ..., and perhaps info.json; or two "
         "or more mesh files (.ply, .obj, .stl) of one topology; or "
         "builtin:NAME[?triangles=N&frames=N] (see 'scene --list')")
      ->required();
  add_session_place(app, a.place);
  add_filter_options(app, a.filters);
  app.add_option("--trials", a.trials, "Trials a frame, each shorter than the one before")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--shrink", a.shrink, "Length of a trial, of that before it; in (0, 1]")
      ->check(CLI::Range(0x1p-20, 1.0))
      ->capture_default_str();
  app.add_flag("--max-step", a.max_step,
               "First ask how far the motion may go, leaving out what overlaps at its start; the first trial "
               "goes so far");
  app.add_option("--keep", a.keep, "With --max-step: the share of that length which the first trial takes")
      ->check(CLI::Range(0x1p-20, 1.0))
      ->needs("--max-step")
      ->capture_default_str();
  app.add_option(
         "--keep-distance", a.keep_distance,
         "With --max-step: it may go until a pair comes nearer than this share, in (0, 1), of its own "
         "distance at the start")
      ->needs("--max-step");
  app.add_flag("--compare", a.compare,
               "Beside it, step a second session to the places that are committed, and compare the times");
  app.add_option("--tier", a.tier, "How an elementary test decides")
      ->check(CLI::IsMember({"fast", "certified", "exact"}))
      ->capture_default_str();
  app.add_option("--tolerance", a.options.tolerance,
                 "Certified tier: pairs this close, relative to the query's size, may be reported; in (0, 1]")
      ->capture_default_str();
  app.add_option("--min-separation", a.options.min_separation,
                 "Report pairs that come within this distance, in the scene's unit")
      ->capture_default_str();
  app.add_option("--bodies", a.bodies,
                 "The scene's model: as the input declares it (info.json), all deformable as one, or its "
                 "connected components")
      ->check(CLI::IsMember({"declared", "deformable", "components"}))
      ->capture_default_str();
  app.add_option("--frames", a.frames, "Only the frames from FIRST, where the session starts, to LAST")
      ->type_name("FIRST:LAST");
  app.add_option("--json", a.json_file, "Write the report as JSON; - for stdout, without other output")
      ->type_name("FILE");
  return [arguments] { return solve(*arguments); };
}

}  // namespace warmfront::client
