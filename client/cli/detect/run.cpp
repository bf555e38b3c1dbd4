// SPDX-License-Identifier: Apache-2.0
#include "client/cli/detect/run.h"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <string>
#include <utility>
#include <variant>

#include "client/cli/detect/remote_stepper.h"
#include "client/cli/detect/table.h"
#include "client/cli/verb.h"
#include "client/cli/recording/recorder.h"
#include "client/cli/states/tangle.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

/// Interpolated frames are in double, so with substeps all are.
std::span<const double> widen(const Positions& positions, std::vector<double>& wide) {
  std::visit([&](auto values) { wide.assign(values.begin(), values.end()); }, positions);
  return wide;
}

Error failed(Error error, std::uint64_t number) {
  error.message = "step to frame " + std::to_string(number) + ": " + error.message;
  return error;
}

}  // namespace

DetectRun::DetectRun(const DetectArguments& arguments, std::uint64_t steps)
    : arguments_(arguments),
      table_(arguments.json_file.empty() && !arguments.takes_stdout()),
      progress_("step", steps) {}

Status DetectRun::part(const PartRange& part) {
  Result<FrameSteps> steps = FrameSteps::open(*part.input, part.range, arguments_.substeps);
  if (!steps) return steps.error();
  Result<SceneDescription> scene =
      with_bodies(part.input->scene(), parse_bodies_mode(arguments_.bodies).value());
  if (!scene) return scene.error();
  if (Status status = take_filters(arguments_.filters, *part.input, scene.value()); !status) return status;
  const SceneDescription before = std::exchange(scene_, std::move(scene).value());
  if (Status status = begin(steps.value(), before); !status) return status;
  return step_through(steps.value());
}

Status DetectRun::begin(FrameSteps& steps, const SceneDescription& before) {
  const Positions first = arguments_.substeps > 1 ? Positions(widen(steps.end(), wide_)) : steps.end();
  frames_.emplace(scene_, parse_send_mode(arguments_.send, &scene_).value(), first);
  if (!stepper_) return begin_first(steps, first);
  const std::string moment = "frame " + std::to_string(steps.number()) + ", where the topology changes: ";
  std::optional<std::vector<ReplacedBody>> replaced = replaced_bodies(before, scene_);
  Status changed = replaced ? stepper_->replace(std::move(*replaced), first) : open_stepper(first);
  if (!changed) return Error{changed.error().code, moment + changed.error().message};
  return outputs_->begin_part(scene_, steps);
}

Status DetectRun::open_stepper(const Positions& first) {
  ColliderOptions local = arguments_.options;
  local.explain = false;  // Explanation has its own stepper
  Result<std::unique_ptr<Stepper>> stepper =
      arguments_.server.empty() ? make_local_stepper(scene_, first, local, arguments_.threads)
                                : make_remote_stepper(arguments_.server, arguments_.security, scene_, first,
                                                      arguments_.options);
  if (!stepper) return stepper.error();
  stepper_ = std::move(stepper).value();
  return {};
}

Status DetectRun::begin_first(FrameSteps& steps, const Positions& first) {
  if (Status status = open_stepper(first); !status) return status;
  if (!arguments_.record_file.empty()) {
    Result<Recorder> recorder =
        Recorder::create(arguments_.record_file, scene_, first, arguments_.options);
    if (!recorder) return recorder.error();
    stepper_ = make_recording_stepper(std::move(stepper_), std::move(recorder).value());
  }
  if (arguments_.options.explain) {
    Result<Explanation> started =
        arguments_.server.empty()
            ? Explanation::start(scene_, frames_->placed(), arguments_.options, arguments_.threads)
            : Explanation::of_answers();
    if (!started) return started.error();
    explanation_.emplace(std::move(started).value());
  }
  Result<DetectOutputs> outputs = DetectOutputs::open(arguments_.files, arguments_.options.fields,
                                                      arguments_.inputs.front(), scene_, steps);
  if (!outputs) return outputs.error();
  outputs_.emplace(std::move(outputs).value());
  if (Status status = warn_if_tangled(scene_, first, static_cast<std::uint32_t>(steps.number() / arguments_.substeps));
      !status)
    return status;
  report_.vertices = scene_.vertex_count;
  report_.triangles = scene_.faces.size();
  report_.edges = scene_.edges.size();
  report_.half_spaces = has_half_spaces(scene_);
  report_.options = arguments_.options;
  report_.model = summary_of(scene_);
  report_.threads = stepper_->threads();
  if (table_) print_detect_header(report_.half_spaces);
  return {};
}

Status DetectRun::step_through(FrameSteps& steps) {
  const bool with_contacts = arguments_.options.report != Report::kCount;
  // Files get the frame that `steps` is at with its answer. The window is read each time: after a resume it
  // is that of the current daemon.
  const auto most = [&] {
    return outputs_->any() || explanation_ ? 1 : std::min(arguments_.in_flight, stepper_->window());
  };
  struct HandedOver {
    std::uint64_t number;
    std::uint64_t bytes;
  };
  std::deque<HandedOver> in_flight;
  Positions end;
  for (std::uint64_t step = 1; step <= steps.step_count(); ++step) {
    while (in_flight.size() < most() && step + in_flight.size() <= steps.step_count()) {
      if (Status status = steps.next(); !status) return status;
      end = arguments_.substeps > 1 ? Positions(widen(steps.end(), wide_)) : steps.end();
      if (Status status = stepper_->submit(frames_->next(end)); !status)
        return failed(status.error(), steps.number());
      in_flight.push_back({steps.number(), frames_->bytes()});
    }
    const auto [number, bytes] = in_flight.front();
    in_flight.pop_front();
    Result<StepAnswer> result = stepper_->next_answer();
    if (!result) return failed(result.error(), number);
    const StepAnswer& answer = result.value();
    if (with_contacts) {
      hash_.begin_step(answer.contacts.size());
      for (const ContactRecord& c : answer.contacts) hash_.add(c.kind, c.status, c.vertices, c.toi);
    }
    if (explanation_) {
      const std::uint64_t all_bytes = std::visit([](auto span) { return span.size_bytes(); }, end);
      if (Status status = explanation_->step(frames_->placed(), answer, bytes, all_bytes); !status)
        return status;
    }
    if (Status status = outputs_->step(steps, answer); !status) return status;
    report_.frames.push_back({number, answer.vf, answer.ee, answer.vh, answer.possible, answer.earliest_toi,
                              answer.statistics, bytes});
    if (table_) {
      progress_.clear();
      print_detect_row(report_.frames.back(), report_.half_spaces);
    }
    progress_.update(report_.frames.size());
  }
  return {};
}

Status DetectRun::finish() {
  progress_.clear();
  if (arguments_.options.report != Report::kCount) report_.contacts_hash = hash_.hex();
  if (Status status = outputs_->close(report_); !status) return status;
  if (!arguments_.json_file.empty())
    if (Status status = write_text(arguments_.json_file, format_json(report_)); !status) return status;
  if (arguments_.takes_stdout()) return {};
  print_detect_summary(report_);
  if (frames_->mode() == SendMode::kPoses)
    std::printf("poses put no vertex farther than %.3g from where the input has it\n", frames_->residual());
  if (explanation_) explanation_->print();
  return {};
}

}  // namespace warmfront::client
