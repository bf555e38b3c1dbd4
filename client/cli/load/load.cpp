// SPDX-License-Identifier: Apache-2.0
// The verb `load`: see load.h. Implemented in load/, one file per part.
#include "client/cli/load/load.h"

#include <signal.h>

#include <CLI/CLI.hpp>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/cli/filter_options.h"
#include "client/cli/load/loads.h"
#include "client/cli/load/report.h"
#include "client/cli/load/sweep.h"
#include "client/cli/recording/recorded_input.h"
#include "client/cli/server_options.h"
#include "client/io/file.h"
#include "client/io/input.h"

namespace warmfront::client {
namespace {

using namespace load;  // NOLINT: this file is the front of that folder

struct LoadArguments {
  Plan plan;
  std::vector<std::string> scene{"builtin:cloth-ball?triangles=4000"};
  std::string sessions = "1";
  std::string rate;
  bool poisson = false;
  std::string tier, report;  // empty: the recording's, or the default
  std::string bodies = "declared";
  FilterArguments filters;
  std::string send = "all";
  std::vector<std::string> mix;
  std::optional<double> distance;
  bool check = false;
  std::vector<std::string> limits;
  std::string knee;
  std::string json_file, csv_file, html_file;
};

/// The loads to run one after another, and their limits.
struct Series {
  std::vector<Plan> plans;
  std::vector<Limit> limits;
  std::optional<Limit> knee;
};

/// `options` with the values from the command line.
Result<ColliderOptions> options_with(const LoadArguments& a, ColliderOptions options) {
  if (!a.tier.empty()) {
    const auto tier = parse_tier(a.tier);
    if (!tier) return tier.error();
    options.tier = tier.value();
  }
  if (!a.report.empty()) {
    const auto report = parse_report(a.report);
    if (!report) return report.error();
    options.report = report.value();
  }
  if (Status status = validate(options); !status) return status.error();
  return options;
}

/// The scene to stream, and its options. A recording has its own.
Result<RecordedScene> open_scene(const LoadArguments& a) {
  RecordedScene scene;
  if (a.scene.size() == 1 && is_recording_name(a.scene.front())) {
    Result<RecordedScene> recorded = open_recorded_scene(a.scene.front());
    if (!recorded) return recorded.error();
    scene = std::move(recorded).value();
  } else {
    Result<std::unique_ptr<Input>> input = open_input(a.scene);
    if (!input) return input.error();
    scene.input = std::move(input).value();
  }
  const Result<ColliderOptions> options = options_with(a, scene.options);
  if (!options) return options.error();
  scene.options = options.value();
  return scene;
}

Result<Series> read(LoadArguments& a) {
  if (Status status = check_input_arguments(a.scene); !status) return status.error();
  if (Status status =
          check_one_stdout({{"--json", a.json_file}, {"--csv", a.csv_file}, {"--html", a.html_file}});
      !status)
    return status.error();
  if (Result<ColliderOptions> options = options_with(a, {}); !options) return options.error();
  const Result<SendMode> send = parse_send_mode(a.send);
  if (!send) return send.error();
  a.plan.send = send.value();
  if (a.check && a.plan.send == SendMode::kPoses)
    return invalid_argument("--check needs --send all or moved: fitted poses change positions slightly");
  if (a.poisson && a.rate.empty() && a.knee.empty())
    return invalid_argument("--poisson needs --rate: without it a session sends after each answer");

  const Result<Mix> mix = parse_mix(a.mix);
  if (!mix) return invalid_argument("--mix " + mix.error().message);
  a.plan.mix = mix.value();
  if (a.distance.has_value() != a.plan.mix.has(Asked::kProximity))
    return invalid_argument(a.distance ? "--distance is of proximity, which --mix does not ask"
                                       : "--mix proximity: within which distance? Give --distance");
  a.plan.distance = a.distance.value_or(0);
  if (!(a.plan.distance >= 0 && std::isfinite(a.plan.distance)))
    return invalid_argument("--distance: give a finite length >= 0");
  if (!a.mix.empty() && !a.plan.record_dir.empty())
    return invalid_argument("--record writes what was stepped: leave out --mix");

  Series series;
  for (const std::string& text : a.limits) {
    const Result<Limit> limit = parse_limit(text);
    if (!limit) return invalid_argument("--limit " + limit.error().message);
    series.limits.push_back(limit.value());
  }
  const Result<std::vector<double>> sessions = parse_sweep(a.sessions, true);
  if (!sessions) return invalid_argument("--sessions " + sessions.error().message);
  if (sessions.value().back() > kMostSessions)
    return invalid_argument("--sessions " + a.sessions + ": at most " + std::to_string(kMostSessions) +
                            ", each has its own thread and connection; run more clients");
  Result<std::vector<double>> rates = std::vector<double>{0};
  if (!a.rate.empty()) rates = parse_sweep(a.rate, false);
  if (!rates) return invalid_argument("--rate " + rates.error().message);
  const bool open_loop = !a.rate.empty() || !a.knee.empty();
  a.plan.arrival = !open_loop ? Arrival::kClosed : a.poisson ? Arrival::kPoisson : Arrival::kConstant;
  for (const double n : sessions.value()) {
    for (const double rate : rates.value()) {
      Plan& plan = series.plans.emplace_back(a.plan);
      plan.sessions = static_cast<std::uint32_t>(n);
      plan.rate = rate > 0 ? rate : n;
    }
  }
  if (!a.knee.empty()) {
    const Result<Limit> limit = parse_limit(a.knee);
    if (!limit) return invalid_argument("--knee " + limit.error().message);
    if (series.plans.size() > 1)
      return invalid_argument("--knee searches for the rate: give one --sessions and one --rate to start at");
    series.knee = limit.value();
  }
  return series;
}

std::atomic<bool> interrupted{false};

/// The first interrupt, or SIGTERM, ends the load with a partial report and closes its sessions, the second
/// ends the process.
void heed_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

Status describe_server(const Plan& plan, Report& report) {
  Result<Client> client = Client::connect(plan.server, plan.connection);
  if (!client) return client.error();
  const Result<ServerInfo> info = client.value().server_info();
  if (!info) return info.error();
  report.server = plan.server;
  report.server_version = info.value().version;
  report.server_threads = info.value().threads;
  return {};
}

int exit_code(const Report& report) {
  bool kept = !report.knee || report.knee->rate.has_value();
  for (const Point& point : report.points) {
    const Tally& tally = point.measured.tally;
    if (tally.different > 0) return failure("answers differ: " + tally.first_difference);
    // The search for a knee misses limits by design.
    if (!report.knee) kept = kept && all_kept(point.verdicts);
    for (const Verdict& verdict : point.verdicts)
      if (!verdict.kept && !report.knee)
        std::fprintf(stderr, "warmfront: %s, %u sessions: %s\n", model_of(point.measured.plan).c_str(),
                     point.measured.plan.sessions, verdict.text().c_str());
  }
  if (const int code = finish_output(); code != kExitOk) return code;
  if (!kept) return kExitNo;
  for (const Point& point : report.points) {
    const Measured& measured = point.measured;
    // The search for a knee may lose sessions.
    if (report.knee || measured.sessions_missing == 0) continue;
    return failure(std::to_string(measured.sessions_missing) + " of " +
                   std::to_string(measured.plan.sessions) +
                   " sessions were missing at the end: " + measured.why_missing);
  }
  return kExitOk;
}

Status write_reports(const LoadArguments& a, const Report& report) {
  const auto write = [](const std::string& path, std::string (*format)(const Report&), const Report& r) {
    return path.empty() ? Status{} : write_text(path, format(r));
  };
  if (Status status = write(a.json_file, format_json, report); !status) return status;
  if (Status status = write(a.csv_file, format_csv, report); !status) return status;
  if (Status status = write(a.html_file, format_html, report); !status) return status;
  if (a.json_file != "-" && a.csv_file != "-" && a.html_file != "-")
    std::fputs(format_text(report).c_str(), stdout);
  return {};
}

int load_verb(LoadArguments a) {
  Result<Series> series = read(a);
  if (!series) return usage_error(series.error().message);
  std::error_code ignored;
  if (!a.plan.record_dir.empty() && !std::filesystem::is_directory(a.plan.record_dir, ignored))
    return failure(a.plan.record_dir + ": not a folder; make it before --record");
  if (Status status = check_writable(std::array{a.json_file, a.csv_file, a.html_file}); !status)
    return failure(status.error().message);
  Result<RecordedScene> opened = open_scene(a);
  if (!opened) return failure(opened.error().message);
  const std::unique_ptr<Input>& input = opened.value().input;
  print_notes(input->notes());
  for (Plan& plan : series.value().plans) plan.options = opened.value().options;
  Result<SceneDescription> scene = with_bodies(input->scene(), parse_bodies_mode(a.bodies).value());
  if (!scene) return failure(scene.error().message);
  if (Status status = take_filters(a.filters, *input, scene.value()); !status)
    return failure(status.error().message);
  const Result<Playback> playback = Playback::read(*input, std::move(scene).value());
  if (!playback) return failure(playback.error().message);
  Report report;
  report.scene = input->name();
  report.vertices = playback.value().scene().vertex_count;
  report.triangles = playback.value().scene().faces.size();
  report.frames = playback.value().frame_count();
  report.model = summary_of(playback.value().scene());
  report.checked = a.check;
  if (Status status = describe_server(a.plan, report); !status) return failure(status.error().message);
  std::optional<ExpectedAnswers> expected;
  if (a.check) {
    Result<ExpectedAnswers> computed =
        ExpectedAnswers::compute(playback.value(), opened.value().options, a.plan.mix, a.plan.distance);
    if (!computed) return failure(computed.error().message);
    expected.emplace(std::move(computed).value());
  }

  heed_interrupts();
  Loads loads(playback.value(), expected ? &*expected : nullptr, interrupted, report);
  const Series& wanted = series.value();
  if (wanted.knee) {
    if (Status found = loads.find_knee(wanted.plans.front(), *wanted.knee, wanted.limits); !found)
      return failure(found.error().message);
  } else {
    for (const Plan& plan : wanted.plans) {
      if (interrupted) break;
      if (Result<const Point*> point = loads.run(plan, wanted.limits); !point)
        return failure(point.error().message);
    }
  }
  if (Status status = write_reports(a, report); !status) return failure(status.error().message);
  return exit_code(report);
}

}  // namespace

Verb add_load(CLI::App& app) {
  auto arguments = std::make_shared<LoadArguments>();
  LoadArguments& a = *arguments;
  add_server_options(app, a.plan.server, a.plan.connection, "Daemon to stream to (HOST:PORT or unix:PATH)",
                     true);
  take_list(app.add_option("--scene", a.scene,
                           "What each session streams, forward and backward: as the INPUT of 'detect', or a "
                           "recording (.wfrec)"))
      ->capture_default_str();
  app.add_option("--sessions", a.sessions, "Number of concurrent sessions: N, or a sweep, 1:64:x2 or 8:64:+8")
      ->capture_default_str();
  app.add_option("--rate", a.rate,
                 "Open loop: frames a second over all sessions, N or a sweep, independent of the answers; "
                 "latency counts from when a frame is due. Without it a session sends after each answer");
  app.add_flag("--poisson", a.poisson, "Open loop with random gaps instead of equal ones");
  app.add_option("--seed", a.plan.seed, "Seed of the random gaps")->capture_default_str();
  take_list(
      app.add_option("--mix", a.mix,
                     "What each session asks in turn, and how often: step, trial, commit, max_step, "
                     "proximity, intersections, like proximity=1,trial=3,commit=1. Trials and max_steps are "
                     "of the motion to the next frame, which a commit takes whole; proximity and "
                     "intersections of where the session is. Without it: steps"))
      ->type_name("NAME=COUNT");
  app.add_option("--distance", a.distance, "Of proximity in --mix: the pairs within it, in the scene's unit");
  const auto time = [&](const char* name, double& seconds, const char* help, bool positive) {
    CLI::Option* option = app.add_option(name, seconds, help);
    option->transform(CLI::AsNumberWithUnit(
        std::map<std::string, double>{{"ms", 1e-3}, {"s", 1}, {"m", 60}, {"h", 3600}},
        static_cast<CLI::AsNumberWithUnit::Options>(CLI::AsNumberWithUnit::CASE_SENSITIVE |
                                                    CLI::AsNumberWithUnit::UNIT_REQUIRED),
        "TIME"));
    option->check(positive ? CLI::Range(1e-3, 1e6) : CLI::Range(0.0, 1e6));
    option->default_str(std::to_string(static_cast<int>(seconds)) + "s");
  };
  time("--duration", a.plan.duration, "Measured time of each load: 500ms, 60s, 5m", true);
  time("--warmup", a.plan.warmup, "Time before it under full load, not measured", false);
  time("--ramp", a.plan.ramp, "Time before that, in which the load grows linearly from zero", false);
  take_list(
      app.add_option(
          "--limit", a.limits,
          "Limits; the exit code is 1 if one is missed: p99=20ms,errors=0,frames-per-second=500. Names: " +
              limit_names()))
      ->type_name("NAME=VALUE");
  app.add_option("--knee", a.knee,
                 "Search for the highest rate that meets this limit, with a load of --duration per rate, "
                 "repeated if it fails; starts at --rate")
      ->type_name("NAME=VALUE");
  app.add_flag("--check", a.check, "Compare every answer with that of the engine in this process");
  app.add_option("--tier", a.tier, "How an elementary test decides")
      ->check(CLI::IsMember({"fast", "certified", "exact"}))
      ->default_str(std::string(to_string(ColliderOptions{}.tier)) + ", or a recording's");
  app.add_option("--report", a.report,
                 "All contacts, only those at the earliest time, only their number, or untested candidates")
      ->check(CLI::IsMember({"all", "earliest", "count", "candidates"}))
      ->default_str(std::string(to_string(ColliderOptions{}.report)) + ", or a recording's");
  app.add_option("--bodies", a.bodies, "The scene's model, as in 'detect'")
      ->check(CLI::IsMember({"declared", "deformable", "components"}))
      ->capture_default_str();
  add_filter_options(app, a.filters);
  app.add_option("--send", a.send, "What a frame carries, as in 'detect'")
      ->check(CLI::IsMember({"all", "moved", "poses"}))
      ->capture_default_str();
  app.add_option("--record", a.plan.record_dir,
                 "Record each session into this folder: SESSION.wfrec, for 'replay' and as --scene")
      ->type_name("FOLDER");
  const auto file = [&](const char* name, std::string& path, const char* help) {
    app.add_option(name, path, help)->type_name("FILE");
  };
  file("--json", a.json_file, "Write the report as JSON; - for stdout, without other output");
  file("--csv", a.csv_file, "Write one row per load as CSV; - for stdout, without other output");
  file("--html", a.html_file, "Write the report as one self-contained page with plots");
  app.footer(
      "Exit codes: 0 ok, 1 a limit was missed, or no rate meets the knee's, 2 failed, a session was missing "
      "at the end, or an answer differs from the engine's, 3 usage. An interrupt ends the load and reports "
      "what was measured.");
  return [arguments] { return load_verb(*arguments); };
}

}  // namespace warmfront::client
