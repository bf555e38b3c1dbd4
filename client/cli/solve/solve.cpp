// SPDX-License-Identifier: Apache-2.0
// The verb `solve`: see solve.h. What it does in a frame: line_search.h; what it tells: solve_report.h.
#include "client/cli/solve/solve.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/cli/filter_options.h"
#include "client/cli/frames/frame_model.h"
#include "client/cli/frames/frame_steps.h"
#include "client/cli/frames/model_summary.h"
#include "client/cli/frames/open_session.h"
#include "client/cli/progress.h"
#include "client/cli/solve/line_search.h"
#include "client/cli/solve/report.h"
#include "client/io/file.h"
#include "client/io/input.h"

namespace warmfront::client {
namespace {

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
      print_solve_frame(frames.back());
    }
    progress.update(step);
  }
  progress.clear();
  if (!arguments.json_file.empty()) {
    const std::string text = solve_json(arguments, summary_of(scene), frames, search.hash());
    if (Status status = write_text(arguments.json_file, text); !status)
      return failure(status.error().message);
  }
  if (table) print_solve_summary(arguments, frames, search.hash());
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
