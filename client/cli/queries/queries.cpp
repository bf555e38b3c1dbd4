// SPDX-License-Identifier: Apache-2.0
// The verb `queries`: see queries.h.
#include "client/cli/queries/queries.h"

#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/cli/progress.h"
#include "client/cli/queries/query_run.h"
#include "client/io/contact_writer.h"
#include "client/io/file.h"
#include "client/io/query_file.h"
#include "client/io/text.h"
#include "engine/options.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// The arguments as given.
struct QueriesArguments {
  std::vector<std::string> paths;
  std::string tier{to_string(ElementaryOptions{}.tier)};
  std::string type;
  ElementaryOptions options;
  std::uint32_t repeat = 5;
  std::string json_file;
  std::string per_query_file;
};

/// Results of all queries of one kind.
struct KindResult {
  QueryTally tally;
  std::vector<double> nanoseconds;
};

Status check_usage(QueriesArguments& arguments) {
  const Result<Tier> tier = parse_tier(arguments.tier);
  if (!tier) return tier.error();
  ElementaryOptions& options = arguments.options;
  options.tier = tier.value();
  if (options.min_separation > 0 && options.tier == Tier::kFast) {
    return invalid_argument("--min-separation needs --tier certified or exact: fast tests touching only");
  }
  return validate(ColliderOptions{
      .tier = options.tier, .tolerance = options.tolerance, .min_separation = options.min_separation});
}

void append_row(std::string& csv, const QueryFile& file, std::size_t index, const Verdict& verdict) {
  csv += csv_field(file.path) + "," + std::to_string(index) + "," + std::string(short_name(file.kind)) +
         (file.queries[index].truth ? ",1," : ",0,") + (verdict.contact ? "1," : "0,");
  if (verdict.contact) append_round_trip(csv, verdict.toi);
  csv += "\n";
}

/// Runs all queries through the tier; `kinds` by ContactKind, `csv` one line per query if requested.
void run_all(const QueriesArguments& arguments, const std::vector<QueryFile>& files, KindResult (&kinds)[2],
             std::string* csv) {
  const std::vector<TypedQuery> queries = all_queries(files);
  Progress progress("test", arguments.repeat * queries.size());
  const std::vector<TimedVerdict> results = run_timed(queries, arguments.options, arguments.repeat,
                                                      [&](std::uint64_t done) { progress.update(done); });
  auto result = results.begin();
  for (const QueryFile& file : files) {
    KindResult& kind = kinds[static_cast<int>(file.kind)];
    for (std::size_t i = 0; i < file.queries.size(); ++i, ++result) {
      kind.tally.add(result->verdict, file.queries[i].truth);
      kind.nanoseconds.push_back(result->nanoseconds);
      if (csv) append_row(*csv, file, i, result->verdict);
    }
  }
}

Json to_json(const KindResult& kind) {
  const Times times = times_of(kind.nanoseconds);
  return {{"queries", kind.tally.queries},
          {"false_positives", kind.tally.false_positives},
          {"false_negatives", kind.tally.false_negatives},
          {"possible", kind.tally.possible},
          {"ns_per_query", times.mean},
          {"ns_max", times.max}};
}

void print_row(const char* name, const KindResult& kind) {
  const Times times = times_of(kind.nanoseconds);
  std::printf("%-4s %9" PRIu64 " %9" PRIu64 " %15" PRIu64 " %15" PRIu64 " %9" PRIu64 " %12.0f %9.0f %9.0f\n",
              name, kind.tally.queries, kind.tally.contacts, kind.tally.false_positives,
              kind.tally.false_negatives, kind.tally.possible, times.mean, times.p99, times.max);
}

void print_table(const KindResult (&kinds)[2]) {
  std::printf("%-4s %9s %9s %15s %15s %9s %12s %9s %9s\n", "type", "queries", "contacts", "false positives",
              "false negatives", "possible", "ns per query", "ns p99", "ns max");
  KindResult both = kinds[0];
  both.tally += kinds[1].tally;
  both.nanoseconds.insert(both.nanoseconds.end(), kinds[1].nanoseconds.begin(), kinds[1].nanoseconds.end());
  print_row("vf", kinds[0]);
  print_row("ee", kinds[1]);
  print_row("all", both);
}

/// "no" when the tier broke its guarantee: nothing missed (certified), nothing wrong (exact, of which a
/// separation finds more than the files' truth, touching).
int exit_code(const QueriesArguments& arguments, const KindResult (&kinds)[2]) {
  QueryTally all = kinds[0].tally;
  all += kinds[1].tally;
  const Tier tier = arguments.options.tier;
  if (tier != Tier::kFast && all.false_negatives > 0) return kExitNo;
  const bool touching = arguments.options.min_separation == 0;
  if (tier == Tier::kExact && touching && all.false_positives > 0) return kExitNo;
  return kExitOk;
}

int queries(QueriesArguments arguments) {
  if (Status status = check_usage(arguments); !status) {
    // A tier that this build lacks is not a usage error.
    const bool missing = status.error().code == ErrorCode::kUnimplemented;
    return missing ? failure(status.error().message) : usage_error(status.error().message);
  }
  if (Status status =
          check_one_stdout({{"--json", arguments.json_file}, {"--per-query", arguments.per_query_file}});
      !status)
    return usage_error(status.error().message);
  std::optional<ContactKind> kind;
  if (!arguments.type.empty())
    kind = arguments.type == "vf" ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
  const Result<std::vector<QueryFile>> files = read_query_files(arguments.paths, kind);
  if (!files) return failure(files.error().message);

  KindResult kinds[2];
  std::string csv = "file,index,type,truth,answer,toi\n";
  run_all(arguments, files.value(), kinds, arguments.per_query_file.empty() ? nullptr : &csv);
  if (!arguments.per_query_file.empty()) {
    if (Status status = write_text(arguments.per_query_file, csv); !status)
      return failure(status.error().message);
  }
  if (!arguments.json_file.empty()) {
    const Json json{{"tier", arguments.tier}, {"vf", to_json(kinds[0])}, {"ee", to_json(kinds[1])}};
    if (Status status = write_text(arguments.json_file, json.dump(1) + "\n"); !status)
      return failure(status.error().message);
  }
  if (arguments.json_file != "-" && arguments.per_query_file != "-") print_table(kinds);
  if (const int code = finish_output(); code != kExitOk) return code;
  return exit_code(arguments, kinds);
}

}  // namespace

Verb add_queries(CLI::App& app) {
  auto arguments = std::make_shared<QueriesArguments>();
  QueriesArguments& a = *arguments;
  app.add_option("PATH", a.paths,
                 "Query files, or folders with .csv files anywhere below: eight rows a query, "
                 "x_num,x_den,y_num,y_den,z_num,z_den,truth")
      ->required();
  app.add_option("--tier", a.tier, "How an elementary test decides")
      ->check(CLI::IsMember({"fast", "certified", "exact"}))
      ->capture_default_str();
  app.add_option("--type", a.type,
                 "Treat all queries as vertex-face (vf) or edge-edge (ee); default: by a path component "
                 "named vertex-face, vf, edge-edge or ee")
      ->check(CLI::IsMember({"vf", "ee"}));
  app.add_option("--tolerance", a.options.tolerance,
                 "Certified tier: pairs this close, relative to the query's size, may be reported; in (0, 1]")
      ->capture_default_str();
  app.add_option("--min-separation", a.options.min_separation,
                 "Tiers certified and exact: report pairs that come within this distance (the files' truth "
                 "is touching)")
      ->capture_default_str();
  app.add_option("--repeat", a.repeat, "Test each query this many times; its time is the median")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--json", a.json_file, "Write the counts as JSON; - for stdout, without other output")
      ->type_name("FILE");
  app.add_option("--per-query", a.per_query_file,
                 "Write one line per query as CSV: file,index,type,truth,answer,toi (index from 0; toi empty "
                 "without a contact); - for stdout, without other output")
      ->type_name("FILE");
  app.footer(
      "Exit codes: 0 ok, 1 a false negative (tiers certified and exact) or a false positive (exact), 2 "
      "failed, 3 usage.");
  return [arguments] { return queries(*arguments); };
}

}  // namespace warmfront::client
