// SPDX-License-Identifier: Apache-2.0
// The verb `bench`: see bench.h.
#include "client/cli/bench/bench.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/bench/report.h"
#include "client/cli/bench/span.h"
#include "client/cli/exit_codes.h"
#include "client/cli/progress.h"
#include "client/cli/svg.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

/// The arguments as given.
struct BenchArguments {
  std::vector<std::string> inputs;
  std::string tier{to_string(ColliderOptions{}.tier)};
  std::string report{to_string(ColliderOptions{}.report)};
  ColliderOptions options;
  std::vector<int> threads;
  std::vector<std::string> ablations{"all"};
  std::uint32_t substeps = 1;
  std::uint32_t rounds = 3;
  std::string frames;
  std::string csv_file;
  std::string json_file;
  std::string svg_folder;
  bool span = false;
};

/// 1, 2, 4, ... and the number of cores.
std::vector<int> default_threads(int cores) {
  std::vector<int> threads;
  for (int count = 1; count < cores; count *= 2) threads.push_back(count);
  threads.push_back(cores);
  return threads;
}

Result<Ablations> read_ablations(const std::vector<std::string>& names) {
  const auto has = [&](const char* name) { return std::ranges::find(names, name) != names.end(); };
  if (has("none") && names.size() > 1) return invalid_argument("--ablations: none goes with no other");
  const bool all = has("all");
  return Ablations{.front = all || has("front"),
                   .cones = all || has("cones"),
                   .bounds = all || has("bounds"),
                   .found = all || has("found"),
                   .leaf = all || has("leaf"),
                   .tier = all || has("tier")};
}

Result<std::vector<BenchSetting>> read_settings(const BenchArguments& arguments, int cores) {
  ColliderOptions options = arguments.options;
  options.bounds = BoundsKind::kKDop18;  // else the trial of bounds would be timed too
  const Result<Tier> tier = parse_tier(arguments.tier);
  if (!tier) return tier.error();
  const Result<Report> report = parse_report(arguments.report);
  if (!report) return report.error();
  options.tier = tier.value();
  options.report = report.value();
  if (Status status = validate(options); !status) return status.error();
  const Result<Ablations> ablations = read_ablations(arguments.ablations);
  if (!ablations) return ablations.error();
  return bench_settings(options, arguments.threads.empty() ? default_threads(cores) : arguments.threads,
                        ablations.value());
}

Result<FrameRange> read_range(const BenchArguments& arguments, const Input& input) {
  if (arguments.frames.empty()) return FrameRange{0, input.frame_count() - 1};
  return parse_frame_range(arguments.frames, input.frame_count());
}

int bench_span(const BenchArguments& arguments, const BenchContext& context,
               std::span<const BenchSetting> settings, std::span<const std::vector<std::string>> groups) {
  std::printf("%s", format_bench_context({context.machine, context.build}).c_str());
  for (const std::vector<std::string>& group : groups) {
    const Result<std::unique_ptr<Input>> input = open_input(group);
    if (!input) return failure(input.error().message);
    const Result<FrameRange> range = read_range(arguments, *input.value());
    if (!range) return usage_error(range.error().message);
    const Result<std::string> table =
        measure_span(*input.value(), range.value(), arguments.substeps, settings.front().options);
    if (!table) return failure(group.front() + ": " + table.error().message);
    std::printf("\n%s\n%s", group.front().c_str(), table.value().c_str());
    std::fflush(stdout);
  }
  return finish_output();
}

Status write_plots(const std::string& folder, std::span<const BenchReport> reports) {
  if (Status status = make_folder(folder); !status) return status;
  for (const BenchReport& report : reports) {
    const std::string path =
        (std::filesystem::path(folder) / svg_file_name(report.input + "-bench")).string();
    if (Status status = write_file(path, format_bench_svg(report)); !status) return status;
  }
  return {};
}

int bench(const BenchArguments& arguments) {
  const BenchContext context{this_machine(), this_build(), arguments.rounds};
  const Result<std::vector<BenchSetting>> settings = read_settings(arguments, context.machine.cores);
  if (!settings) return usage_error(settings.error().message);
  if (Status status = check_one_stdout({{"--json", arguments.json_file}, {"--csv", arguments.csv_file}});
      !status)
    return usage_error(status.error().message);
  const std::array<std::string, 8> words{"none", "all", "front", "cones", "bounds", "found", "leaf", "tier"};
  if (Status status = check_paths(arguments.inputs, words); !status) return failure(status.error().message);
  const std::vector<std::vector<std::string>> groups = group_inputs(arguments.inputs);
  for (const std::vector<std::string>& group : groups)
    if (Status status = check_input_arguments(group); !status) return usage_error(status.error().message);
  if (arguments.span) {
    if (!arguments.json_file.empty() || !arguments.csv_file.empty() || !arguments.svg_folder.empty())
      return usage_error("--span prints a table of its own: it goes without --json, --csv and --svg");
    return bench_span(arguments, context, settings.value(), groups);
  }
  if (Status status = check_writable(std::array{arguments.json_file, arguments.csv_file}); !status)
    return failure(status.error().message);
  const bool tables = arguments.json_file != "-" && arguments.csv_file != "-";
  if (tables) std::printf("%s", format_bench_context(context).c_str());
  std::vector<BenchReport> reports;
  for (const std::vector<std::string>& group : groups) {
    const std::string& path = group.front();
    const Result<std::unique_ptr<Input>> input = open_input(group);
    if (!input) return failure(input.error().message);
    print_notes(input.value()->notes());
    const Result<FrameRange> range = read_range(arguments, *input.value());
    if (!range) return usage_error(range.error().message);
    std::optional<Progress> bar;
    Result<BenchReport> measured =
        measure_bench(short_name(path), *input.value(), range.value(), arguments.substeps, settings.value(),
                      arguments.rounds, [&](std::uint64_t done, std::uint64_t total) {
                        if (!bar) bar.emplace("run", total);
                        bar->update(done);
                      });
    bar.reset();
    if (!measured) return failure(path + ": " + measured.error().message);
    if (tables) {
      std::printf("\n%s", format_bench_tables(measured.value()).c_str());
      std::fflush(stdout);
    }
    reports.push_back(std::move(measured).value());
  }
  if (!arguments.csv_file.empty()) {
    if (Status status = write_text(arguments.csv_file, format_bench_csv(context, reports)); !status)
      return failure(status.error().message);
  }
  if (!arguments.json_file.empty()) {
    if (Status status = write_text(arguments.json_file, format_bench_json(context, reports)); !status)
      return failure(status.error().message);
  }
  if (!arguments.svg_folder.empty()) {
    if (Status status = write_plots(arguments.svg_folder, reports); !status)
      return failure(status.error().message);
  }
  if (const int code = finish_output(); code != kExitOk) return code;
  int code = kExitOk;
  for (const BenchReport& report : reports) {
    if (!report.disagreement) continue;
    failure(report.input + ": " + *report.disagreement);
    code = kExitNo;
  }
  return code;
}

}  // namespace

Verb add_bench(CLI::App& app) {
  auto arguments = std::make_shared<BenchArguments>();
  BenchArguments& a = *arguments;
  app.add_option("INPUT", a.inputs,
                 "Scenes: a folder with mesh.ply and frames.pc2, or with t0.ply, t1.ply, ...; or "
                 "builtin:NAME[?triangles=N&frames=N]; measured one after the other. Mesh files of one "
                 "topology are the frames of one scene")
      ->required();
  app.add_option("--tier", a.tier, "Default tier")
      ->check(CLI::IsMember({"fast", "certified", "exact"}))
      ->capture_default_str();
  app.add_option("--tolerance", a.options.tolerance, "Certified tier: see detect")->capture_default_str();
  app.add_option("--min-separation", a.options.min_separation,
                 "Report pairs that come within this distance, in the scene's unit")
      ->capture_default_str();
  app.add_option("--report", a.report, "All contacts, or only those at the earliest time")
      ->check(CLI::IsMember({"all", "earliest"}))
      ->capture_default_str();
  CLI::Option* const threads =
      take_list(app.add_option("--threads-list", a.threads,
                               "Numbers of threads to measure the default setting on; ablations run on the "
                               "first. Default: 1, 2, 4, ... and the number of cores"))
          ->check(CLI::Range(1, 1024));
  CLI::Option* const ablations =
      take_list(app.add_option(
                    "--ablations", a.ablations,
                    "What to vary: none, all, or some of front (none, paper, warm, lazy), cones, bounds, "
                    "found (bodies and rigid motion found by the collider), leaf (size), tier"))
          ->check(CLI::IsMember({"none", "all", "front", "cones", "bounds", "found", "leaf", "tier"}))
          ->capture_default_str();
  app.add_option("--frames", a.frames, "Only the steps from frame FIRST to frame LAST")
      ->type_name("FIRST:LAST");
  app.add_option("--substeps", a.substeps, "Split each step linearly into this many substeps")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  CLI::Option* const rounds =
      app.add_option("--rounds", a.rounds,
                     "Run everything this many times, in turn; times are medians of the rounds' means")
          ->check(CLI::Range(1, 10'000))
          ->capture_default_str();
  app.add_option("--csv", a.csv_file, "Write the measurements as CSV; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--json", a.json_file, "Write them as JSON; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--svg", a.svg_folder,
                 "Write one plot per input into this folder: stage times of each setting")
      ->type_name("DIR");
  app.add_flag(
         "--span", a.span,
         "Instead, what each step forks into, recorded on one thread five times, each piece as long as it "
         "was at best: its work, its longest chain, and the speed-up of a greedy schedule on up to 128 "
         "cores; what the cores of this machine made of it, each step once and so with all noise; below it "
         "where the chain's time goes, its five longest places in the engine's source: in the tasks that "
         "are forked there, or after them, on one thread")
      ->excludes(threads)
      ->excludes(ablations)
      ->excludes(rounds);
  app.footer(
      "Times and counts are those of a warm frame; the first step, which builds hierarchy and front, is "
      "reported separately\n(an input of one step has only that). To measure the effect of SIMD, set "
      "WARMFRONT_INSTRUCTIONS=baseline\nin the environment. Exit codes: 0 ok, 1 answers differ, 2 failed, 3 "
      "usage.");
  return [arguments] { return bench(*arguments); };
}

}  // namespace warmfront::client
