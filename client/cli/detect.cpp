// SPDX-License-Identifier: Apache-2.0
// The verb `detect`: see detect.h.
#include "client/cli/detect.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/contact_fields.h"
#include "client/cli/detect_outputs.h"
#include "client/cli/exit_codes.h"
#include "client/cli/explain.h"
#include "client/cli/filter_options.h"
#include "client/cli/frame_model.h"
#include "client/cli/frame_steps.h"
#include "client/cli/html_options.h"
#include "client/cli/progress.h"
#include "client/cli/recording/recorder.h"
#include "client/cli/remote_stepper.h"
#include "client/cli/report_json.h"
#include "client/cli/server_options.h"
#include "client/cli/stepper.h"
#include "client/cli/tangle.h"
#include "client/io/file.h"
#include "client/io/input.h"
#include "engine/contact_hash.h"

namespace warmfront::client {
namespace {

/// The arguments as given.
struct DetectArguments {
  std::vector<std::string> inputs;
  std::string server;
  ClientSecurity security;
  std::string tier{to_string(ColliderOptions{}.tier)};
  std::string report{to_string(ColliderOptions{}.report)};
  std::string front{to_string(ColliderOptions{}.front)};
  std::string bounds{to_string(ColliderOptions{}.bounds)};
  std::string lazy = ColliderOptions{}.lazy_front ? "on" : "off";
  std::string normal_cones = ColliderOptions{}.normal_cones ? "on" : "off";
  ColliderOptions options;
  int threads = 0;
  std::uint32_t substeps = 1;
  std::string bodies = "declared";
  std::string send;  ///< as parse_send_mode() takes it
  std::vector<std::string> fields;
  std::string find_bodies = "on";
  std::string find_rigid = "on";
  std::string separate_parts = "on";
  std::string frames;
  FilterArguments filters;
  std::size_t in_flight = 2;
  OutputFiles files;
  std::string json_file;
  std::string record_file;
};

/// Parses the names into options; fails for the first invalid one.
Status read_names(DetectArguments& arguments) {
  const auto take = [](auto parsed, auto& field) -> Status {
    if (!parsed) return parsed.error();
    field = parsed.value();
    return {};
  };
  ColliderOptions& options = arguments.options;
  options.lazy_front = arguments.lazy == "on";
  options.normal_cones = arguments.normal_cones == "on";
  options.find_bodies = arguments.find_bodies == "on";
  options.find_rigid = arguments.find_rigid == "on";
  options.separate_parts = arguments.separate_parts == "on";
  options.fields = fields_named(arguments.fields);
  if (Status s = take(parse_tier(arguments.tier), options.tier); !s) return s;
  if (Status s = take(parse_report(arguments.report), options.report); !s) return s;
  if (Status s = take(parse_front_mode(arguments.front), options.front); !s) return s;
  if (Status s = take(parse_bounds_kind(arguments.bounds), options.bounds); !s) return s;
  return validate(options);
}

/// Checks the arguments without opening anything.
Status check_usage(DetectArguments& arguments) {
  if (Status status = check_input_arguments(arguments.inputs); !status) return status;
  if (Status status = read_names(arguments); !status) return status;
  if (Result<BodiesMode> bodies = parse_bodies_mode(arguments.bodies); !bodies) return bodies.error();
  if (Result<SendMode> send = parse_send_mode(arguments.send); !send) return send.error();
  if (arguments.options.explain && arguments.options.report != Report::kAll)
    return invalid_argument("--explain needs --report all: it compares the contacts");
  if (arguments.threads != 0 && !arguments.server.empty() && !arguments.options.explain)
    return invalid_argument("--threads is for this process; with --server the daemon's --threads applies");
  if (Status status = check_one_stdout({{"--json", arguments.json_file},
                                        {"--contacts", arguments.files.contacts},
                                        {"--html", arguments.files.html.file}});
      !status)
    return status;
  return DetectOutputs::check(arguments.files, arguments.options);
}

/// Is one of the outputs stdout, which must then carry nothing else?
bool takes_stdout(const DetectArguments& arguments) {
  return arguments.json_file == "-" || arguments.files.contacts == "-" || arguments.files.html.file == "-";
}

// With a column for half-spaces where there are any.
void print_header(bool half_spaces) {
  std::printf("%8s %9s %9s %s%9s %12s %10s %9s %9s %9s %9s %11s %s\n", "frame", "vf", "ee",
              half_spaces ? "       vh " : "", "possible", "earliest toi", "total ms", "refit", "front",
              "elem.", "adjacent", "tri. pairs", "front");
}

void print_row(const FrameReport& frame, bool half_spaces) {
  char vh[32] = "";
  if (half_spaces) std::snprintf(vh, sizeof vh, "%9" PRIu64 " ", frame.vh);
  char toi[32] = "-";
  if (frame.earliest_toi) std::snprintf(toi, sizeof toi, "%.9f", *frame.earliest_toi);
  const StageTimes& ms = frame.statistics.ms;
  const std::string state(to_string(frame.statistics.front_state));
  std::printf("%8" PRIu64 " %9" PRIu64 " %9" PRIu64 " %s%9" PRIu64
              " %12s %10.3f %9.3f %9.3f %9.3f %9.3f %11" PRIu64 " %s\n",
              frame.frame, frame.vf, frame.ee, vh, frame.possible, toi, ms.total, ms.refit, ms.front,
              ms.elementary, ms.adjacent, frame.statistics.counts.triangle_pairs, state.c_str());
  std::fflush(stdout);
}

void print_summary(const DetectReport& report) {
  std::uint64_t vf = 0, ee = 0, vh = 0, possible = 0;
  double ms = 0;
  for (const FrameReport& frame : report.frames) {
    vf += frame.vf;
    ee += frame.ee;
    vh += frame.vh;
    possible += frame.possible;
    ms += frame.statistics.ms.total;
  }
  const std::string edges = report.edges > 0 ? std::to_string(report.edges) + " edges, " : "";
  const std::string of_half_spaces = vh > 0 ? ", " + std::to_string(vh) + " vh" : "";
  std::printf("%zu steps of %" PRIu64 " triangles, %s%" PRIu64 " vertices: %" PRIu64 " contacts (%" PRIu64
              " vf, %" PRIu64 " ee%s; %" PRIu64 " possible), %.3f ms a step on %d thread%s\n",
              report.frames.size(), report.triangles, edges.c_str(), report.vertices, vf + ee + vh, vf, ee,
              of_half_spaces.c_str(), possible, ms / static_cast<double>(report.frames.size()),
              report.threads, report.threads == 1 ? "" : "s");
  if (!report.contacts_hash.empty()) std::printf("contacts hash %s\n", report.contacts_hash.c_str());
}

/// Interpolated frames are in double, so with substeps all are.
std::span<const double> widen(const Positions& positions, std::vector<double>& wide) {
  std::visit([&](auto values) { wide.assign(values.begin(), values.end()); }, positions);
  return wide;
}

/// Steps through everything; fills in the report.
Status step_through(const DetectArguments& arguments, FrameSteps& steps, FrameModel& frames, Stepper& stepper,
                    Explanation* explanation, DetectOutputs& outputs, DetectReport& report) {
  const bool with_contacts = arguments.options.report != Report::kCount;
  const bool table = arguments.json_file.empty() && !takes_stdout(arguments);
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
  if (table) print_header(report.half_spaces);
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
      print_row(report.frames.back(), report.half_spaces);
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
  if (!takes_stdout(arguments)) {
    print_summary(report);
    if (frames.mode() == SendMode::kPoses)
      std::printf("poses put no vertex farther than %.3g from where the input has it\n", frames.residual());
    if (explanation) explanation->print();
  }
  return finish_output();
}

}  // namespace

Verb add_detect(CLI::App& app) {
  auto arguments = std::make_shared<DetectArguments>();
  DetectArguments& a = *arguments;
  app.add_option(
         "INPUT", a.inputs,
         "A folder with mesh.ply and frames.pc2, or t0.ply, t1.ply, ..., and perhaps info.json; or two "
         "or more mesh "
         "files (.ply, .obj, .stl) of one topology; or builtin:NAME[?triangles=N&frames=N] (see "
         "'scene --list')")
      ->required();
  add_server_options(app, a.server, a.security,
                     "Step on the daemon at this address (HOST:PORT or unix:PATH), not in this process",
                     false);
  app.add_option("--tier", a.tier, "How an elementary test decides")
      ->check(CLI::IsMember({"fast", "certified", "exact"}))
      ->capture_default_str();
  app.add_option("--tolerance", a.options.tolerance,
                 "Certified tier: pairs this close, relative to the query's size, may be reported; in (0, 1]")
      ->capture_default_str();
  app.add_option("--min-separation", a.options.min_separation,
                 "Report pairs that come within this distance, in the scene's unit")
      ->capture_default_str();
  app.add_option(
         "--report", a.report,
         "All contacts, only those at the earliest time, only their number, or all pairs whose moving bounds "
         "overlap, untested. With --min-separation, pairs "
         "nearer than that at a step's start have time 0, and earliest then reports only these")
      ->check(CLI::IsMember({"all", "earliest", "count", "candidates"}))
      ->capture_default_str();
  app.add_option("--front", a.front, "How the traversal is cached between steps; the contacts are the same")
      ->check(CLI::IsMember({"none", "paper", "warm"}))
      ->capture_default_str();
  app.add_option("--bounds", a.bounds,
                 "Bounding volumes; auto chooses by the counts of the first steps; the contacts are the same")
      ->check(CLI::IsMember({"auto", "aabb", "kdop18"}))
      ->capture_default_str();
  app.add_option("--threads", a.threads, "Threads in this process; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--substeps", a.substeps,
                 "Split each step linearly into this many substeps, which 'frame' then counts")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--bodies", a.bodies,
                 "The scene's model: as the input declares it (info.json), all deformable as one, or its "
                 "connected components")
      ->check(CLI::IsMember({"declared", "deformable", "components"}))
      ->capture_default_str();
  app.add_option("--send", a.send,
                 "Content of a frame: all positions; only what moved; or poses fitted to rigid bodies, and "
                 "what else moved. Along a screw a body moves by poses alone")
      ->check(CLI::IsMember({"all", "moved", "poses"}))
      ->default_str("all, or poses where a body moves along a screw");
  app.add_option(
         "--in-flight", a.in_flight,
         "With --server: most unanswered frames, limited by the daemon's window; 1: each frame waits for the "
         "previous answer, as in many simulations, and always with output files, --explain or --record")
      ->check(CLI::Range(1, 1024))
      ->needs("--server")
      ->capture_default_str();
  app.add_option("--find-bodies", a.find_bodies,
                 "Without declared bodies, use the connected components as bodies; the contacts are the same")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--find-rigid", a.find_rigid,
                 "Find bodies that move rigidly, and skip testing them against themselves where the contacts "
                 "stay the same")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--separate-parts", a.separate_parts,
                 "Look for a plane between small near bodies; the contacts are the same")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  add_fields_option(app, a.fields);
  app.add_flag("--explain", a.options.explain,
               "Also step an all-deformable scene, compare the contacts (in this process), and print what "
               "the model saves");
  app.add_option("--frames", a.frames, "Only the steps from frame FIRST to frame LAST")
      ->type_name("FIRST:LAST");
  add_filter_options(app, a.filters);
  app.add_option("--contacts", a.files.contacts,
                 "Write the contacts: .csv, .jsonl, or .vtp (one file per frame, and a .pvd that lists "
                 "them); - for stdout, as CSV and without other output")
      ->type_name("FILE");
  app.add_flag("--continuity", a.files.continuity,
               "Write in --contacts whether each contact is new, or kept from the step before");
  app.add_flag(
      "--ended", a.files.ended,
      "--continuity, and write the contacts of the step before that ended, after those that there are");
  app.add_option("--meshes", a.files.meshes,
                 "Write the meshes for ParaView: .vtp (one file per frame, each vertex with its least time "
                 "of impact, and a .pvd that lists them)")
      ->type_name("FILE");
  add_html_options(app, a.files.html,
                   "the meshes moving, their contacts by time of impact, counts and stage times");
  app.add_option("--json", a.json_file, "Write the report as JSON; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--record", a.record_file,
                 "Record the session's frames and answers, for 'replay'; the file must not exist")
      ->type_name("FILE");
  app.add_option("--leaf-size", a.options.leaf_size, "Most triangles in a leaf of the hierarchy")
      ->check(CLI::IsMember({1, 2, 4, 8, 16, 32, 64}))
      ->capture_default_str();
  app.add_option("--rebuild-after", a.options.rebuild_after_stalled_steps,
                 "Front 'paper': rebuild after this many consecutive steps without growth; 0: never")
      ->capture_default_str();
  app.add_option("--rebuild-every", a.options.rebuild_every_steps,
                 "Front 'paper': rebuild every this many steps; 0: never")
      ->capture_default_str();
  app.add_option("--lazy", a.lazy, "Warm front: skip pairs that cannot have come together yet")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--normal-cones", a.normal_cones,
                 "Cull flat patches by normal cone and contour test (tier exact)")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  return [arguments] { return detect(*arguments); };
}

}  // namespace warmfront::client
