// SPDX-License-Identifier: Apache-2.0
// The verb `detect`: see detect.h. Its arguments: detect_arguments.h; its table: detect_table.h.
#include "client/cli/detect/detect.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/detect/arguments.h"
#include "client/cli/detect/explain.h"
#include "client/cli/detect/outputs.h"
#include "client/cli/detect/remote_stepper.h"
#include "client/cli/detect/report_json.h"
#include "client/cli/detect/stepper.h"
#include "client/cli/detect/table.h"
#include "client/cli/exit_codes.h"
#include "client/cli/frames/frame_model.h"
#include "client/cli/frames/frame_steps.h"
#include "client/cli/progress.h"
#include "client/cli/recording/recorder.h"
#include "client/cli/states/tangle.h"
#include "client/io/file.h"
#include "client/io/input.h"
#include "engine/contact_hash.h"

namespace warmfront::client {
namespace {

/// Interpolated frames are in double, so with substeps all are.
std::span<const double> widen(const Positions& positions, std::vector<double>& wide) {
  std::visit([&](auto values) { wide.assign(values.begin(), values.end()); }, positions);
  return wide;
}

/// Steps through everything; fills in the report.
Status step_through(const DetectArguments& arguments, FrameSteps& steps, FrameModel& frames, Stepper& stepper,
                    Explanation* explanation, DetectOutputs& outputs, DetectReport& report) {
  const bool with_contacts = arguments.options.report != Report::kCount;
  const bool table = arguments.json_file.empty() && !arguments.takes_stdout();
  ContactHash hash;
  std::vector<double> wide;
  Progress progress("step", steps.step_count());
  // Files get the frame that `steps` is at with its answer. The window is read each time: after a resume it
  // is that of the current daemon.
  const auto most = [&] {
    return outputs.any() || explanation ? 1 : std::min(arguments.in_flight, stepper.window());
  };
  struct HandedOver {
    std::uint64_t number;
    std::uint64_t bytes;
  };
  std::deque<HandedOver> in_flight;
  const auto failed = [](Error error, std::uint64_t number) {
    error.message = "step to frame " + std::to_string(number) + ": " + error.message;
    return error;
  };
  if (table) print_detect_header(report.half_spaces);
  Positions end;
  for (std::uint64_t step = 1; step <= steps.step_count(); ++step) {
    while (in_flight.size() < most() && step + in_flight.size() <= steps.step_count()) {
      if (Status status = steps.next(); !status) return status;
      end = arguments.substeps > 1 ? Positions(widen(steps.end(), wide)) : steps.end();
      if (Status status = stepper.submit(frames.next(end)); !status)
        return failed(status.error(), steps.number());
      in_flight.push_back({steps.number(), frames.bytes()});
    }
    const auto [number, bytes] = in_flight.front();
    in_flight.pop_front();
    Result<StepAnswer> result = stepper.next_answer();
    if (!result) return failed(result.error(), number);
    const StepAnswer& answer = result.value();
    if (with_contacts) {
      hash.begin_step(answer.contacts.size());
      for (const ContactRecord& c : answer.contacts) hash.add(c.kind, c.status, c.vertices, c.toi);
    }
    if (explanation) {
      const std::uint64_t all_bytes = std::visit([](auto span) { return span.size_bytes(); }, end);
      if (Status status = explanation->step(frames.placed(), answer, bytes, all_bytes); !status)
        return status;
    }
    if (Status status = outputs.step(steps, answer); !status) return status;
    report.frames.push_back({number, answer.vf, answer.ee, answer.vh, answer.possible, answer.earliest_toi,
                             answer.statistics, bytes});
    if (table) {
      progress.clear();
      print_detect_row(report.frames.back(), report.half_spaces);
    }
    progress.update(step);
  }
  if (with_contacts) report.contacts_hash = hash.hex();
  return {};
}

int detect(DetectArguments arguments) {
  if (Status status = check_usage(arguments); !status) {
    // A tier that this build lacks is not a usage error.
    const bool missing = status.error().code == ErrorCode::kUnimplemented;
    return missing ? failure(status.error().message) : usage_error(status.error().message);
  }
  if (Status status = check_writable(std::array{arguments.json_file, arguments.files.html.file}); !status)
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
  Result<FrameSteps> steps = FrameSteps::open(input, range, arguments.substeps);
  if (!steps) return failure(steps.error().message);

  std::vector<double> wide;
  const Positions first =
      arguments.substeps > 1 ? Positions(widen(steps.value().end(), wide)) : steps.value().end();
  Result<SceneDescription> scene = with_bodies(input.scene(), parse_bodies_mode(arguments.bodies).value());
  if (!scene) return failure(scene.error().message);
  if (Status status = take_filters(arguments.filters, input, scene.value()); !status)
    return failure(status.error().message);
  FrameModel frames(scene.value(), parse_send_mode(arguments.send, &scene.value()).value(), first);
  ColliderOptions local = arguments.options;
  local.explain = false;  // Explanation has its own stepper
  Result<std::unique_ptr<Stepper>> stepper =
      arguments.server.empty() ? make_local_stepper(scene.value(), first, local, arguments.threads)
                               : make_remote_stepper(arguments.server, arguments.security, scene.value(),
                                                     first, arguments.options);
  if (!stepper) return failure(stepper.error().message);
  if (!arguments.record_file.empty()) {
    Result<Recorder> recorder =
        Recorder::create(arguments.record_file, scene.value(), first, arguments.options);
    if (!recorder) return failure(recorder.error().message);
    stepper = make_recording_stepper(std::move(stepper).value(), std::move(recorder).value());
  }
  std::optional<Explanation> explanation;
  if (arguments.options.explain) {
    Result<Explanation> started =
        arguments.server.empty()
            ? Explanation::start(scene.value(), frames.placed(), arguments.options, arguments.threads)
            : Explanation::of_answers();
    if (!started) return failure(started.error().message);
    explanation.emplace(std::move(started).value());
  }

  Result<DetectOutputs> outputs = DetectOutputs::open(arguments.files, arguments.options.fields,
                                                      arguments.inputs.front(), scene.value(), steps.value());
  if (!outputs) return failure(outputs.error().message);
  if (Status status = warn_if_tangled(scene.value(), first, range.first); !status)
    return failure(status.error().message);

  DetectReport report;
  report.vertices = input.scene().vertex_count;
  report.triangles = input.scene().faces.size();
  report.edges = input.scene().edges.size();
  report.half_spaces = has_half_spaces(scene.value());
  report.options = arguments.options;
  report.model = summary_of(scene.value());
  report.threads = stepper.value()->threads();
  const Status stepped = step_through(arguments, steps.value(), frames, *stepper.value(),
                                      explanation ? &*explanation : nullptr, outputs.value(), report);
  if (!stepped) return failure(stepped.error().message);
  if (Status status = outputs.value().close(report); !status) return failure(status.error().message);
  if (!arguments.json_file.empty()) {
    if (Status status = write_text(arguments.json_file, format_json(report)); !status)
      return failure(status.error().message);
  }
  if (!arguments.takes_stdout()) {
    print_detect_summary(report);
    if (frames.mode() == SendMode::kPoses)
      std::printf("poses put no vertex farther than %.3g from where the input has it\n", frames.residual());
    if (explanation) explanation->print();
  }
  return finish_output();
}

}  // namespace

Verb add_detect(CLI::App& app) {
  auto arguments = std::make_shared<DetectArguments>();
  add_detect_options(app, *arguments);
  return [arguments] { return detect(*arguments); };
}

}  // namespace warmfront::client
