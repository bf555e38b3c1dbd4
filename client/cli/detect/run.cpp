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
#include "client/cli/ranges/input_digest.h"
#include "client/cli/recording/recorder.h"
#include "client/cli/states/tangle.h"
#include "client/cli/verb.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

/// Interpolated frames are in double, so with substeps all are.
std::span<const double> widen(const Positions& positions, std::vector<double>& wide) {
  std::visit([&](auto values) { wide.assign(values.begin(), values.end()); }, positions);
  return wide;
}

/// Where the step ends, as it is sent.
Positions end_of(const FrameSteps& steps, std::uint32_t substeps, std::vector<double>& wide) {
  return substeps > 1 ? Positions(widen(steps.end(), wide)) : steps.end();
}

Error failed(Error error, std::uint64_t number) {
  error.message = "step to frame " + std::to_string(number) + ": " + error.message;
  return error;
}

}  // namespace

DetectRun::DetectRun(const DetectArguments& arguments, Input& input, FrameRange range)
    : arguments_(arguments),
      input_(input),
      range_(range),
      table_(arguments.json_file.empty() && !arguments.takes_stdout()),
      progress_("step", std::uint64_t{range.last - range.first} * arguments.substeps) {
  if (!arguments.json_file.empty() && range.first > 0 && arguments.options.report != Report::kCount)
    hash_part_.emplace();
}

Result<SceneDescription> DetectRun::scene_of(Input& part) const {
  Result<SceneDescription> scene = with_bodies(part.scene(), parse_bodies_mode(arguments_.bodies).value());
  if (!scene) return scene.error();
  if (Status status = take_filters(arguments_.filters, part, scene.value()); !status) return status.error();
  return scene;
}

Status DetectRun::part(const PartRange& part) {
  Result<FrameSteps> steps = FrameSteps::open(*part.input, part.range, arguments_.substeps);
  if (!steps) return steps.error();
  Result<SceneDescription> scene = scene_of(*part.input);
  if (!scene) return scene.error();
  const SceneDescription before = std::exchange(scene_, std::move(scene).value());
  if (Status status = begin(part, steps.value(), before); !status) return status;
  if (Status status = step_through(steps.value()); !status) return status;
  if (!arguments_.json_file.empty()) report_.range.ends_at = digest_of(steps.value().end());
  return {};
}

Status DetectRun::begin(const PartRange& part, FrameSteps& steps, const SceneDescription& before) {
  const Positions first = end_of(steps, arguments_.substeps, wide_);
  if (!stepper_) return begin_first(part, steps, first);
  frames_.emplace(scene_, parse_send_mode(arguments_.send, &scene_).value(), first);
  const std::string moment = "frame " + std::to_string(steps.number()) + ", where the topology changes: ";
  std::optional<std::vector<ReplacedBody>> replaced = replaced_bodies(before, scene_);
  if (!replaced && !arguments_.record_file.empty())
    return invalid_argument(moment +
                            "--record: more than bodies' meshes are others, which no change of a session "
                            "is; declare bodies (--bodies components), or give --frames on one side of it");
  Status changed = replaced ? stepper_->replace(std::move(*replaced), first) : open_stepper(first);
  if (!changed) return Error{changed.error().code, moment + changed.error().message};
  return outputs_->begin_part(scene_, steps);
}

Status DetectRun::open_stepper(const Positions& first) {
  ColliderOptions local = arguments_.options;
  local.explain = false;  // Explanation has its own stepper
  Result<std::unique_ptr<Stepper>> stepper =
      arguments_.server.empty()
          ? make_local_stepper(scene_, first, local, arguments_.threads)
          : make_remote_stepper(arguments_.server, arguments_.connection, scene_, first, arguments_.options);
  if (!stepper) return stepper.error();
  stepper_ = std::move(stepper).value();
  return {};
}

/// Makes the session as a run from the part's first frame would have it at `first`: rigid bodies that are
/// posed have the shape of `reference`, that frame. Gives the contacts of the step before, where they are to
/// be compared.
Result<std::vector<ContactRecord>> DetectRun::enter(const PartRange& part, const Positions& first,
                                                    const Positions& reference) {
  const bool looks_back = (arguments_.files.continuity || arguments_.files.ended) && part.range.first > 0;
  std::optional<FrameSteps> before;
  std::vector<double> wide;
  Positions at = first;
  if (looks_back) {
    Result<FrameSteps> steps =
        FrameSteps::open(*part.input, {part.range.first - 1, part.range.first}, arguments_.substeps);
    if (!steps) return steps.error();
    before.emplace(std::move(steps).value());
    at = end_of(*before, arguments_.substeps, wide);
  }
  const SendMode mode = parse_send_mode(arguments_.send, &scene_).value();
  const bool posed = mode == SendMode::kPoses && part.range.first > 0;
  frames_.emplace(scene_, mode, posed ? reference : at);
  if (Status status = open_stepper(posed ? reference : at); !status) return status.error();
  if (posed)
    if (Status status = stepper_->place(frames_->next(at)); !status) return status.error();
  if (!looks_back) return std::vector<ContactRecord>();
  Result<StepAnswer> last = StepAnswer{};
  for (std::uint64_t step = 0; step < before->step_count(); ++step) {
    if (Status status = before->next(); !status) return status.error();
    last = stepper_->step(frames_->next(end_of(*before, arguments_.substeps, wide)));
    if (!last) return failed(last.error(), before->number());
  }
  return std::move(last.value().contacts);
}

Status DetectRun::start_recording(const Positions& first, const Positions& reference) {
  const SendMode mode = frames_->mode();
  FrameModel from_reference(scene_, mode, reference);
  const bool posed = mode == SendMode::kPoses && range_.first > 0;
  Result<Recorder> recorder =
      posed ? Recorder::create(arguments_.record_file, scene_, reference, arguments_.options,
                               from_reference.next(first))
            : Recorder::create(arguments_.record_file, scene_, first, arguments_.options);
  if (!recorder) return recorder.error();
  stepper_ = make_recording_stepper(std::move(stepper_), std::move(recorder).value());
  return {};
}

Status DetectRun::start_report(const Positions& first) {
  report_.vertices = scene_.vertex_count;
  report_.triangles = scene_.faces.size();
  report_.edges = scene_.edges.size();
  report_.half_spaces = has_half_spaces(scene_);
  report_.options = arguments_.options;
  report_.model = summary_of(scene_);
  report_.threads = stepper_->threads();
  if (arguments_.json_file.empty()) return {};
  RangeReport& range = report_.range;
  range.version = WARMFRONT_VERSION;
  range.input = input_.name();
  range.frames = range_;
  range.last_of_input = frames_of_all_parts(input_) - 1;
  range.substeps = arguments_.substeps;
  std::string more = std::to_string(range.last_of_input) + " " + std::to_string(range.substeps);
  for (const Input* part = input_.next(); part != nullptr; part = part->next()) {
    range.topology_changes.push_back(part->first_number());
    more += " " + std::to_string(part->first_number());
  }
  if (frames_->mode() == SendMode::kPoses) more += " poses";
  if (arguments_.files.continuity || arguments_.files.ended) more += " continuity";
  if (arguments_.files.ended) more += " ended";
  PositionBuffer first_of_input;
  if (Status status = input_.read_frame(0, first_of_input); !status) return status;
  const Result<SceneDescription> scene = scene_of(input_);
  if (!scene) return scene.error();
  range.digest = digest_of(scene.value(), view(first_of_input), arguments_.options, more);
  range.starts_at = digest_of(first);
  return {};
}

Status DetectRun::begin_first(const PartRange& part, FrameSteps& steps, const Positions& first) {
  PositionBuffer first_of_part;
  std::vector<double> wide;
  Positions reference = first;
  if (part.range.first > 0) {
    if (Status status = part.input->read_frame(0, first_of_part); !status) return status;
    reference = arguments_.substeps > 1 ? Positions(widen(view(first_of_part), wide)) : view(first_of_part);
  }
  Result<std::vector<ContactRecord>> before = enter(part, first, reference);
  if (!before) return before.error();
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
  outputs_->remember(std::move(before).value());
  if (Status status =
          warn_if_tangled(scene_, first, static_cast<std::uint32_t>(steps.number() / arguments_.substeps));
      !status)
    return status;
  if (Status status = start_report(steps.end()); !status) return status;
  if (!arguments_.record_file.empty())
    if (Status status = start_recording(first, reference); !status) return status;
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
      end = end_of(steps, arguments_.substeps, wide_);
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
    if (hash_part_) {
      hash_part_->begin_step(answer.contacts.size());
      for (const ContactRecord& c : answer.contacts) hash_part_->add(c.kind, c.status, c.vertices, c.toi);
    }
    if (explanation_) {
      const std::uint64_t all_bytes = std::visit([](auto span) { return span.size_bytes(); }, end);
      if (Status status = explanation_->step(frames_->placed(), answer, bytes, all_bytes); !status)
        return status;
    }
    if (Status status = outputs_->step(steps, answer, frames_->twists()); !status) return status;
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
  report_.range.hash = hash_part_;
  if (!arguments_.files.contacts.empty() && arguments_.files.contacts != "-" && !arguments_.json_file.empty())
    report_.range.contacts = {beside_report(arguments_.files.contacts, arguments_.json_file),
                              outputs_->rows()};
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
