// SPDX-License-Identifier: Apache-2.0
// `warmfront VERB`: the command line. Verbs run on this thread.
#include <absl/synchronization/mutex.h>
#include <malloc.h>
#include <signal.h>
#include <stdlib.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/accuracy/accuracy.h"
#include "client/cli/bench/bench.h"
#include "client/cli/detect/detect.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/load/load.h"
#include "client/cli/merge/merge.h"
#include "client/cli/queries/queries.h"
#include "client/cli/recording/replay.h"
#include "client/cli/scene.h"
#include "client/cli/sessions.h"
#include "client/cli/solve/solve.h"
#include "client/cli/states/near.h"
#include "client/cli/states/tangled.h"
#include "proto/command_line/baseline_build.h"
#include "proto/command_line/unknown_option.h"

namespace {

using warmfront::client::Verb;

/// The innermost named verb, for "see ... --help".
std::string help_command(const CLI::App& app) {
  std::string command = "warmfront";
  for (const CLI::App* verb : app.get_subcommands()) command += " " + verb->get_name();
  return command + " --help";
}

/// The long names of all options that are valid there.
std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  const CLI::App* verb = &app;
  for (;;) {
    for (const CLI::Option* option : verb->get_options())
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    if (verb->get_subcommands().empty()) return names;
    verb = verb->get_subcommands().front();
  }
}

/// A forgotten value is missed where it is, and not where the option that was taken for it is missed. `verb`
/// must outlive the parsing.
void refuse_options_as_values(CLI::App& verb) {
  const auto look = [&verb](const std::string& value) {
    const bool is_option =
        value.starts_with("--") && verb.get_option_no_throw(value.substr(0, value.find('='))) != nullptr;
    return is_option ? "its value is missing before " + value : std::string();
  };
  for (CLI::Option* option : verb.get_options())
    if (option->get_items_expected_max() > 0 && !option->get_positional())
      option->transform(CLI::Validator(look, ""));  // before what else is checked
}

int run(int argc, char** argv) {
  CLI::App app("Continuous collision detection between the frames of moving triangle meshes.", "warmfront");
  app.set_version_flag("--version", "warmfront " WARMFRONT_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 ok, 1 the answer is \"no\", 2 failed, 3 usage; ended by a signal, as shells count it "
      "128 and "
      "its\nnumber (130 by an interrupt): nothing is left half written then.\n'warmfront VERB --help' lists "
      "a verb's "
      "options.");
  std::vector<std::pair<CLI::App*, Verb>> verbs;
  const auto add = [&](const char* name, const char* description, Verb (*setup)(CLI::App&)) {
    CLI::App* verb = app.add_subcommand(name, description);
    verbs.emplace_back(verb, setup(*verb));
    refuse_options_as_values(*verb);
  };
  add("detect", "Step through an input's frames and report the contacts", warmfront::client::add_detect);
  add("near", "List the pairs of features that are near each other, frame by frame",
      warmfront::client::add_near);
  add("queries", "Run elementary queries with known answers through one tier",
      warmfront::client::add_queries);
  add("accuracy", "Measure speed against accuracy over query sets and scenes",
      warmfront::client::add_accuracy);
  add("bench", "Measure the times of a step's stages, and the effect of each setting",
      warmfront::client::add_bench);
  add("load", "Stream many sessions to a daemon, and measure latency and throughput",
      warmfront::client::add_load);
  add("merge", "Join the reports of 'detect' over ranges of one input's frames", warmfront::client::add_merge);
  add("replay", "Step through a recorded session again, and compare the answers",
      warmfront::client::add_replay);
  add("scene", "Write a built-in scene as mesh and cache, or list them", warmfront::client::add_scene);
  add("solve", "Play an input's frames as a solver's line search: trials, then a commit",
      warmfront::client::add_solve);
  add("tangled", "List the edges and faces that meet, frame by frame", warmfront::client::add_tangled);
  add("sessions", "List, show, check or close the sessions of a daemon", warmfront::client::add_sessions);

  std::vector<std::string> verb_names;
  for (const auto& [verb, work] : verbs) verb_names.push_back(verb->get_name());
  if (argc > 1 && argv[1][0] != '-' && std::ranges::find(verb_names, argv[1]) == verb_names.end()) {
    const std::string_view meant = warmfront::command_line::nearest(argv[1], verb_names);
    return warmfront::client::usage_error(
        "there is no verb '" + std::string(argv[1]) + "'" +
        (meant.empty() ? "" : "; the nearest is '" + std::string(meant) + "'") + "; see 'warmfront --help'");
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError&) {
    return warmfront::client::usage_error(
        warmfront::command_line::unknown_argument(app.remaining(true), option_names(app)) + "; see '" +
        help_command(app) + "'");
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help and --version
      app.exit(error);
      return warmfront::client::finish_output();
    }
    return warmfront::client::usage_error(std::string(error.what()) + "; see '" + help_command(app) + "'");
  }
  for (const auto& [verb, work] : verbs)
    if (verb->parsed()) return work();
  return warmfront::client::kExitUsage;
}

}  // namespace

int main(int argc, char** argv) {
  warmfront::command_line::become_baseline_build(argv);
  // Failures are reported in one line of our own, which includes gRPC's reason.
  setenv("GRPC_VERBOSITY", "NONE", 0);
  // Frames take megabytes. Returning their memory to the system after each, and mapping it again, costs more
  // than encoding them.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  warmfront::client::end_tidily();
  signal(SIGXFSZ, SIG_IGN);  // a file past the process's limit is an error of its write
  // As in the daemon: Debian builds Abseil with deadlock detection on, which slows gRPC's locks.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    return warmfront::client::failure("out of memory");
  } catch (const std::exception& error) {
    return warmfront::client::failure(error.what());
  }
}
