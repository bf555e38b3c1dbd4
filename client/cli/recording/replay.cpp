// SPDX-License-Identifier: Apache-2.0
// The verb `replay`: see replay.h.
#include "client/cli/recording/replay.h"

#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/exit_codes.h"
#include "client/cli/recording/replay_run.h"
#include "client/cli/server_options.h"

namespace warmfront::client {
namespace {

struct ReplayArguments {
  std::string file;
  std::string server;
  ClientOptions connection;
  bool in_process = false;
  int threads = 0;
  std::string json_file;
};

std::string to_json(const RecordedSession& recorded, const ReplayResult& result) {
  const auto or_null = [](const std::string& text) {
    return text.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(text);
  };
  const nlohmann::ordered_json json{{"writer", recorded.header().writer()},
                                    {"started_unix_ms", recorded.header().started_unix_ms()},
                                    {"vertices", recorded.scene().vertex_count},
                                    {"triangles", recorded.scene().faces.size()},
                                    {"steps", result.steps},
                                    {"placements", result.placements},
                                    {"changes", result.changes},
                                    {"compared", result.compared},
                                    {"left_out", result.left_out},
                                    {"difference", or_null(result.difference)},
                                    {"defect", or_null(result.defect)}};
  return json.dump(1) + "\n";
}

int replay_verb(const ReplayArguments& a) {
  if (a.in_process == !a.server.empty()) return usage_error("give either --in-process or --server ADDR");
  Result<RecordedSession> recorded = RecordedSession::open(a.file);
  if (!recorded) return failure(recorded.error().message);
  Result<std::unique_ptr<ReplayTarget>> target =
      a.in_process ? make_engine_target(recorded.value(), a.threads)
                   : make_remote_target(recorded.value(), a.server, a.connection);
  if (!target) return failure(target.error().message);
  const Result<ReplayResult> replayed = replay(recorded.value(), *target.value(), [](std::uint64_t) {});
  if (!replayed) return failure(replayed.error().message);
  const ReplayResult& result = replayed.value();
  if (!a.json_file.empty()) {
    if (Status status = write_text(a.json_file, to_json(recorded.value(), result)); !status)
      return failure(status.error().message);
  }
  if (a.json_file != "-") {
    std::printf("%s: recorded by %s, %" PRIu32 " vertices, %zu triangles\n", a.file.c_str(),
                recorded.value().header().writer().c_str(), recorded.value().scene().vertex_count,
                recorded.value().scene().faces.size());
    const std::string placements =
        result.placements == 0 ? " and" : ", " + std::to_string(result.placements) + " placements and";
    std::printf("%" PRIu64 " steps%s %" PRIu64 " changes, %" PRIu64 " outcomes compared%s; %" PRIu64
                " refused ones left out\n",
                result.steps, placements.c_str(), result.changes, result.compared,
                result.difference.empty() ? ", all equal" : "", result.left_out);
    if (!result.defect.empty()) std::printf("the recording is incomplete: %s\n", result.defect.c_str());
  }
  if (!result.difference.empty()) return failure(a.file + ": " + result.difference);
  return finish_output();
}

}  // namespace

Verb add_replay(CLI::App& app) {
  auto arguments = std::make_shared<ReplayArguments>();
  ReplayArguments& a = *arguments;
  app.add_option("FILE", a.file,
                 "A recording (.wfrec) of 'detect --record', 'load --record' or a daemon's --record-dir")
      ->required();
  add_server_options(app, a.server, a.connection,
                     "Replay on the daemon at this address (HOST:PORT or unix:PATH)", false);
  app.add_flag("--in-process", a.in_process, "Replay through the engine in this process");
  app.add_option("--threads", a.threads, "Threads in this process; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->excludes("--server")
      ->capture_default_str();
  app.add_option("--json", a.json_file, "Write the outcome as JSON; - for stdout, without other output")
      ->type_name("FILE");
  app.footer(
      "Exit codes: 0 all answers are equal, 2 failed, or an answer differs (the first is named), 3 usage.");
  return [arguments] { return replay_verb(*arguments); };
}

}  // namespace warmfront::client
