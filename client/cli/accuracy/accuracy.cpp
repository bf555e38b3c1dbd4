// SPDX-License-Identifier: Apache-2.0
// The verb `accuracy`: see accuracy.h.
#include "client/cli/accuracy/accuracy.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/accuracy/trade.h"
#include "client/cli/accuracy/turns.h"
#include "client/cli/exit_codes.h"
#include "client/cli/print.h"
#include "client/cli/progress.h"
#include "client/cli/svg.h"
#include "client/io/file.h"
#include "client/io/mesh_file.h"
#include "client/io/query_file.h"
#include "client/io/truth_file.h"

namespace warmfront::client {
namespace {

namespace fs = std::filesystem;

/// The arguments as given.
struct AccuracyArguments {
  std::vector<std::string> paths;
  std::vector<std::string> tiers;  ///< empty: all that apply
  std::vector<double> tolerances{1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12};
  std::vector<std::string> positions{"float64", "float32"};
  std::vector<std::string> bounds{"kdop18", "aabb"};
  double min_separation = 0;
  std::string type;
  std::string frames;
  std::uint32_t substeps = 1;
  std::uint32_t rounds = 3;
  std::vector<double> turns;  ///< degrees
  int threads = 0;
  std::string csv_file;
  std::string json_file;
  std::string svg_folder;
};

/// All combinations; tolerances only for the tier that uses them.
Result<std::vector<TradeSetting>> settings_of(const AccuracyArguments& arguments) {
  std::vector<TradeSetting> settings;
  std::vector<std::string> tiers = arguments.tiers;
  if (tiers.empty()) tiers = {"certified", "exact"};
  if (arguments.tiers.empty() && arguments.min_separation == 0) tiers.insert(tiers.begin(), "fast");
  for (const std::string& positions : arguments.positions) {
    for (const std::string& bounds_name : arguments.bounds) {
      const Result<BoundsKind> bounds = parse_bounds_kind(bounds_name);
      if (!bounds) return bounds.error();
      for (const std::string& tier_name : tiers) {
        const Result<Tier> tier = parse_tier(tier_name);
        if (!tier) return tier.error();
        TradeSetting setting{
            .tier = tier.value(),
            .positions = positions == "float32" ? PositionType::kFloat32 : PositionType::kFloat64,
            .bounds = bounds.value(),
            .separation = arguments.min_separation};
        const bool tolerant = setting.tier == Tier::kCertified;
        for (const double tolerance :
             tolerant ? arguments.tolerances : std::vector<double>{setting.tolerance}) {
          setting.tolerance = tolerance;
          const Status status = validate(ColliderOptions{
              .tier = setting.tier, .tolerance = tolerance, .min_separation = arguments.min_separation});
          if (!status) return status.error();
          settings.push_back(setting);
        }
      }
    }
  }
  // The exact tier gives the reference answers.
  if (Status status = validate(ColliderOptions{.tier = Tier::kExact}); !status) return status.error();
  return settings;
}

std::string set_name(const AccuracyArguments& arguments, const std::string& path) {
  if (arguments.min_separation == 0) return short_name(path);
  return short_name(path) + print(", separation %g", arguments.min_separation);
}

bool is_scene(const std::string& path) {
  std::error_code ignored;
  return path.starts_with("builtin:") || is_mesh_file_name(path) ||
         fs::exists(fs::path(path) / "mesh.ply", ignored) || fs::exists(fs::path(path) / "t0.ply", ignored);
}

std::string file_name_of(const TradeRow& row) {
  return svg_file_name(row.set + (row.scene ? "-scene" : "-queries"));
}

Result<SceneTrade> measure_query_set(const AccuracyArguments& arguments, const std::string& path,
                                     std::span<const TradeSetting> settings) {
  std::optional<ContactKind> kind;
  if (!arguments.type.empty())
    kind = arguments.type == "vf" ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
  const Result<std::vector<QueryFile>> files = read_query_files({&path, 1}, kind);
  if (!files) return files.error();
  const std::vector<TypedQuery> queries = all_queries(files.value());
  std::optional<Progress> bar;
  return SceneTrade{measure_queries(set_name(arguments, path), queries, settings, arguments.rounds,
                                    [&](std::uint64_t done, std::uint64_t total) {
                                      if (!bar) bar.emplace("test", total);
                                      bar->update(done);
                                    }),
                    std::nullopt};
}

/// The known answers in a folder's truth.csv, for its one step.
Result<std::optional<KnownPairs>> read_known(const std::string& path, const Input& input) {
  const std::string file = (fs::path(path) / "truth.csv").string();
  std::error_code ignored;
  if (input.frame_count() != 2 || !fs::exists(file, ignored)) return std::optional<KnownPairs>();
  const Result<std::string> text = read_file(file);
  if (!text) return text.error();
  Result<KnownPairs> known = parse_known_pairs(text.value(), file, input.scene().vertex_count);
  if (!known) return known.error();
  return std::optional(std::move(known).value());
}

Result<SceneTrade> measure_input(const AccuracyArguments& arguments, const std::vector<std::string>& paths,
                                 std::span<const TradeSetting> settings) {
  const std::string& path = paths.front();
  const Result<std::unique_ptr<Input>> opened = open_input(paths);
  if (!opened) return opened.error();
  Input& input = *opened.value();
  print_notes(input.notes());
  FrameRange range{0, input.frame_count() - 1};
  if (!arguments.frames.empty()) {
    const Result<FrameRange> parsed = parse_frame_range(arguments.frames, input.frame_count());
    if (!parsed) return parsed.error();
    range = parsed.value();
  }
  const Result<std::optional<KnownPairs>> known = read_known(path, input);
  if (!known) return known.error();
  const bool comparable = known.value() && arguments.substeps == 1 && arguments.min_separation == 0;
  std::optional<Progress> bar;
  return measure_scene(set_name(arguments, path), input, range, arguments.substeps, settings,
                       arguments.rounds, std::make_shared<Workers>(arguments.threads),
                       comparable ? &*known.value() : nullptr, [&](std::uint64_t done, std::uint64_t total) {
                         if (!bar) bar.emplace("run", total);
                         bar->update(done);
                       });
}

std::string format(const KnownComparison& c) {
  char text[256];
  std::snprintf(text, sizeof text,
                "\ntruth.csv: %s; of tier exact's contacts %" PRIu64 " are missing, %" PRIu64
                " are known to be none, and of %" PRIu64 " it says nothing\n",
                counted(c.known, "contact").c_str(), c.missing, c.contradicted, c.beyond);
  return text;
}

Status write_plots(const std::string& folder, std::span<const TradeRow> rows) {
  if (Status status = make_folder(folder); !status) return status;
  for (auto begin = rows.begin(); begin != rows.end();) {
    const auto end = std::find_if(
        begin, rows.end(), [&](const TradeRow& r) { return r.set != begin->set || r.scene != begin->scene; });
    if (Status status =
            write_file((fs::path(folder) / file_name_of(*begin)).string(), format_trade_svg({begin, end}));
        !status)
      return status;
    begin = end;
  }
  return {};
}

// What lines lose where bodies turn, of each scene.
int accuracy_of_turns(const AccuracyArguments& arguments) {
  if (Status status = check_one_stdout({{"--json", arguments.json_file}, {"--csv", arguments.csv_file}});
      !status)
    return usage_error(status.error().message);
  for (const double degrees : arguments.turns) {
    if (!(degrees > 0 && degrees < 180))
      return usage_error("--turns: " + print("%g", degrees) +
                         " is not between 0 and 180: a screw turns by less than half a turn");
  }
  if (!arguments.svg_folder.empty()) return usage_error("--turns has no plot; leave --svg out");
  if (Status status = check_paths(arguments.paths, {}); !status) return failure(status.error().message);
  const bool tables = arguments.json_file != "-" && arguments.csv_file != "-";
  const auto workers = std::make_shared<Workers>(arguments.threads);
  std::vector<TurnRow> rows;
  for (const std::vector<std::string>& group : group_inputs(arguments.paths)) {
    if (!is_scene(group.front())) return usage_error("--turns: " + group.front() + " is no scene");
    if (Status status = check_input_arguments(group); !status) return usage_error(status.error().message);
    const Result<std::unique_ptr<Input>> opened = open_input(group);
    if (!opened) return failure(opened.error().message);
    print_notes(opened.value()->notes());
    std::uint32_t frame = 0;
    if (!arguments.frames.empty()) {
      const Result<FrameRange> parsed = parse_frame_range(arguments.frames, opened.value()->frame_count());
      if (!parsed) return failure(parsed.error().message);
      frame = parsed.value().first;
    }
    const Result<std::vector<TurnRow>> own =
        measure_turns(set_name(arguments, group.front()), *opened.value(), frame, arguments.turns,
                      arguments.min_separation, arguments.rounds, workers);
    if (!own) return failure(own.error().message);
    if (tables) std::printf("%s%s", rows.empty() ? "" : "\n", format_turns_table(own.value()).c_str());
    rows.insert(rows.end(), own.value().begin(), own.value().end());
  }
  if (!arguments.csv_file.empty()) {
    if (Status status = write_text(arguments.csv_file, format_turns_csv(rows)); !status)
      return failure(status.error().message);
  }
  if (!arguments.json_file.empty()) {
    if (Status status = write_text(arguments.json_file, format_turns_json(rows)); !status)
      return failure(status.error().message);
  }
  return finish_output();
}

int accuracy(const AccuracyArguments& arguments) {
  if (!arguments.turns.empty()) return accuracy_of_turns(arguments);
  const Result<std::vector<TradeSetting>> settings = settings_of(arguments);
  if (!settings) {
    // A tier that this build lacks is not a usage error.
    const bool missing = settings.error().code == ErrorCode::kUnimplemented;
    return missing ? failure(settings.error().message) : usage_error(settings.error().message);
  }
  if (Status status = check_one_stdout({{"--json", arguments.json_file}, {"--csv", arguments.csv_file}});
      !status)
    return usage_error(status.error().message);
  // Checked before long computations.
  const std::array<std::string, 7> words{"fast",    "certified", "exact", "float64",
                                         "float32", "kdop18",    "aabb"};
  if (Status status = check_paths(arguments.paths, words); !status) return failure(status.error().message);
  const std::vector<std::vector<std::string>> groups = group_inputs(arguments.paths);
  for (const std::vector<std::string>& group : groups) {
    if (!is_scene(group.front())) continue;
    if (Status status = check_input_arguments(group); !status) return usage_error(status.error().message);
  }
  if (Status status = check_writable(std::array{arguments.json_file, arguments.csv_file}); !status)
    return failure(status.error().message);
  const bool tables = arguments.json_file != "-" && arguments.csv_file != "-";
  std::vector<TradeRow> rows;
  bool agrees = true;
  for (const std::vector<std::string>& group : groups) {
    Result<SceneTrade> measured = is_scene(group.front())
                                      ? measure_input(arguments, group, settings.value())
                                      : measure_query_set(arguments, group.front(), settings.value());
    if (!measured) return failure(measured.error().message);
    const auto& [own, comparison] = measured.value();
    if (tables) {
      std::printf("%s%s%s", rows.empty() ? "" : "\n", format_trade_table(own).c_str(),
                  comparison ? format(*comparison).c_str() : "");
      std::fflush(stdout);
    }
    agrees = agrees && (!comparison || comparison->agrees());
    rows.insert(rows.end(), own.begin(), own.end());
  }
  if (!arguments.csv_file.empty()) {
    if (Status status = write_text(arguments.csv_file, format_trade_csv(rows)); !status)
      return failure(status.error().message);
  }
  if (!arguments.svg_folder.empty()) {
    if (Status status = write_plots(arguments.svg_folder, rows); !status)
      return failure(status.error().message);
  }
  if (!arguments.json_file.empty()) {
    if (Status status = write_text(arguments.json_file, format_trade_json(rows)); !status)
      return failure(status.error().message);
  }
  if (const int code = finish_output(); code != kExitOk) return code;
  return agrees ? kExitOk : kExitNo;
}

}  // namespace

Verb add_accuracy(CLI::App& app) {
  auto arguments = std::make_shared<AccuracyArguments>();
  AccuracyArguments& a = *arguments;
  app.add_option("PATH", a.paths,
                 "Scenes (a folder with mesh.ply and frames.pc2, or with t0.ply, t1.ply, ...; builtin:NAME; "
                 "mesh files, which are the frames of one) and query sets (a query file, or a folder with "
                 ".csv files anywhere below); a table each")
      ->required();
  take_list(
      app.add_option("--tiers", a.tiers,
                     "Tiers to measure; default: all, but fast, which tests touching, with a separation"))
      ->check(CLI::IsMember({"fast", "certified", "exact"}));
  take_list(app.add_option("--tolerances", a.tolerances, "Tolerances of the certified tier, each in (0, 1]"))
      ->capture_default_str();
  take_list(app.add_option("--positions", a.positions,
                           "Precisions of the positions; the truth is that of the original positions"))
      ->check(CLI::IsMember({"float64", "float32"}))
      ->capture_default_str();
  take_list(app.add_option("--bounds", a.bounds, "Scenes: bounding volumes"))
      ->check(CLI::IsMember({"aabb", "kdop18"}))
      ->capture_default_str();
  app.add_option(
         "--min-separation", a.min_separation,
         "Pairs that come within this distance, in the scene's unit; the exact tier then says which do, "
         "of queries too")
      ->capture_default_str();
  app.add_option("--type", a.type,
                 "Treat all queries as vertex-face (vf) or edge-edge (ee); default: by a path component "
                 "named vertex-face, vf, edge-edge or ee")
      ->check(CLI::IsMember({"vf", "ee"}));
  app.add_option("--frames", a.frames, "Scenes: only the steps from frame FIRST to frame LAST")
      ->type_name("FIRST:LAST");
  app.add_option("--substeps", a.substeps, "Scenes: split each step linearly into this many substeps")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  take_list(app.add_option("--turns", a.turns,
                           "Scenes: instead, what lines lose: each rigid body turns in one step by so many "
                           "degrees, from where the first of --frames has it, along lines and along screws"));
  app.add_option("--rounds", a.rounds, "Measure everything this many times; times are medians")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  app.add_option("--threads", a.threads, "Scenes: threads; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--csv", a.csv_file, "Write the table as CSV; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--json", a.json_file, "Write the table as JSON; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--svg", a.svg_folder, "Write one plot per set into this folder: accuracy against cost")
      ->type_name("DIR");
  app.footer(
      "The truth is the files' own for query sets and the exact tier's for scenes; a folder's truth.csv "
      "checks the "
      "latter.\nExit codes: 0 ok, 1 the exact tier and a truth.csv disagree, 2 failed, 3 usage.");
  return [arguments] { return accuracy(*arguments); };
}

}  // namespace warmfront::client
