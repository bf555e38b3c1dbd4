// SPDX-License-Identifier: Apache-2.0
// The verb `sessions`: see sessions.h.
#include "client/cli/sessions.h"

#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/cli/frames/model_summary.h"
#include "client/cli/server_options.h"
#include "client/lib/client.h"
#include "engine/options.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

struct SessionsArguments {
  std::string server;
  ClientOptions connection;
  bool all = false;
  std::string action = "list";
  std::string id;
  std::string principal;
  std::string json_file;
};

/// 2026-01-31T12:00:00Z
std::string format_time(std::chrono::system_clock::time_point time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

Json to_json(const SessionInfo& info) {
  Json json{{"id", info.id},
            {"principal", info.principal},
            {"vertices", info.vertex_count},
            {"triangles", info.face_count},
            {"edges", info.edge_count},
            {"lone_edges", info.lone_edge_count},
            {"bodies", info.body_count},
            {"precision", info.float32 ? "float32" : "float64"},
            {"tier", to_string(info.options.tier)},
            {"tolerance", info.options.tolerance},
            {"min_separation", info.options.min_separation},
            {"report", to_string(info.options.report)},
            {"front", to_string(info.options.front)},
            {"bounds", to_string(info.options.bounds)},
            {"last_frame", info.last_frame},
            {"steps", info.steps},
            {"memory_bytes", info.memory_bytes},
            {"attached", info.attached},
            {"created", format_time(info.created)},
            {"idle_ms", info.idle.count()}};
  add_to(json, summary_of(info));
  return json;
}

/// With whose it is, of sessions of all principals.
void print_row(const SessionInfo& info, bool all) {
  std::printf("%-36s %10" PRIu32 " %10" PRIu32 " %10" PRIu64 " %9.1f %9.1f %-8s%s%s\n", info.id.c_str(),
              info.face_count, info.vertex_count, info.last_frame,
              static_cast<double>(info.memory_bytes) / (1 << 20),
              static_cast<double>(info.idle.count()) / 1000, info.attached ? "attached" : "-", all ? " " : "",
              all ? (info.principal.empty() ? "-" : info.principal.c_str()) : "");
}

void print_all(const SessionInfo& info) {
  const Json json = to_json(info);  // must outlive the loop, which refers to it
  for (const auto& [key, value] : json.items())
    std::printf("%-16s %s\n", key.c_str(),
                value.is_string() ? value.get<std::string>().c_str() : value.dump().c_str());
}

/// Prints for people, unless JSON goes to stdout.
int show(const SessionsArguments& arguments, const std::vector<SessionInfo>& sessions) {
  const bool one = arguments.action == "show";
  if (!arguments.json_file.empty()) {
    Json json;
    if (one) {
      json = to_json(sessions.front());
    } else {
      json["sessions"] = Json::array();
      for (const SessionInfo& info : sessions) json["sessions"].push_back(to_json(info));
    }
    if (const Status written = write_text(arguments.json_file, json.dump(1) + "\n"); !written)
      return failure(written.error().message);
  }
  if (arguments.json_file == "-") return finish_output();
  if (one) {
    print_all(sessions.front());
    return finish_output();
  }
  std::printf("%-36s %10s %10s %10s %9s %9s %-8s%s\n", "session", "triangles", "vertices", "frame", "MiB",
              "idle s", "stream", arguments.all ? " principal" : "");
  for (const SessionInfo& info : sessions) print_row(info, arguments.all);
  return finish_output();
}

/// Of one session: a daemon's own advice is for the client that streams it.
int failure_of(const SessionsArguments& arguments, const Error& error) {
  if (error.code != ErrorCode::kNotFound) return failure(error.message);
  return failure(
      "session " + arguments.id +
      (arguments.all
           ? " is not in this daemon; 'sessions list --all' shows which are"
           : " is not in this daemon, or not yours; 'sessions list' shows yours, with --all everybody's"));
}

int close_session(const SessionsArguments& arguments, Client& client) {
  if (const Status closed = arguments.all ? client.delete_any_session(arguments.id, arguments.principal)
                                          : client.delete_session(arguments.id);
      !closed)
    return failure_of(arguments, closed.error());
  if (!arguments.json_file.empty()) {
    const Json json{{"closed", arguments.id}};
    if (const Status written = write_text(arguments.json_file, json.dump(1) + "\n"); !written)
      return failure(written.error().message);
  }
  if (arguments.json_file != "-") std::printf("closed %s\n", arguments.id.c_str());
  return finish_output();
}

int check_session(const SessionsArguments& arguments, Client& client) {
  const Result<std::string> found = client.check_session(arguments.id);
  if (!found) return failure_of(arguments, found.error());
  const bool sound = found.value().empty();
  if (!arguments.json_file.empty()) {
    const Json json{{"checked", arguments.id}, {"sound", sound}, {"found", found.value()}};
    if (const Status written = write_text(arguments.json_file, json.dump(1) + "\n"); !written)
      return failure(written.error().message);
  }
  if (arguments.json_file != "-")
    std::printf("%s: %s\n", arguments.id.c_str(), sound ? "sound" : found.value().c_str());
  const int written = finish_output();
  return written == kExitOk && !sound ? kExitNo : written;
}

int sessions(const SessionsArguments& arguments) {
  if (!arguments.principal.empty() && !(arguments.action == "close" && arguments.all))
    return usage_error(
        "--principal selects the owner of the session to close: sessions close ID --all --principal P");
  if (arguments.action != "list" && arguments.id.empty())
    return usage_error("sessions " + arguments.action + ": an ID is needed; 'sessions list' shows them");
  if (arguments.action == "list" && !arguments.id.empty())
    return usage_error("sessions list takes no ID; 'sessions show ID' shows one");
  Result<Client> client = Client::connect(arguments.server, arguments.connection);
  if (!client) return failure(client.error().message);
  if (arguments.action == "check") {
    if (arguments.all)
      return usage_error("sessions check takes no --all: only a session's owner can check it");
    return check_session(arguments, client.value());
  }
  if (arguments.action == "close") return close_session(arguments, client.value());
  if (arguments.action == "show") {
    if (arguments.all)
      return usage_error("sessions show takes no --all; 'sessions list --all --json -' shows all");
    Result<SessionInfo> info = client.value().get_session(arguments.id);
    if (!info) return failure_of(arguments, info.error());
    return show(arguments, {std::move(info).value()});
  }
  Result<std::vector<SessionInfo>> list =
      arguments.all ? client.value().list_all_sessions() : client.value().list_sessions();
  if (!list) return failure(list.error().message);
  return show(arguments, list.value());
}

}  // namespace

Verb add_sessions(CLI::App& app) {
  auto arguments = std::make_shared<SessionsArguments>();
  SessionsArguments& a = *arguments;
  app.add_option("ACTION", a.action,
                 "Action; a client that is still streaming creates a closed session again")
      ->check(CLI::IsMember({"list", "show", "check", "close"}))
      ->capture_default_str();
  app.add_option("ID", a.id, "The session to show, check or close");
  add_server_options(app, a.server, a.connection, "The daemon's address (HOST:PORT or unix:PATH)", true);
  app.add_flag("--all", a.all, "Sessions of all principals; needs the admin role");
  app.add_option("--principal", a.principal,
                 "With close --all: the session's owner, if several principals use this ID");
  app.add_option("--json", a.json_file, "Write as JSON; - for stdout, without other output")
      ->type_name("FILE");
  return [arguments] { return sessions(*arguments); };
}

}  // namespace warmfront::client
