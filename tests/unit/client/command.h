// SPDX-License-Identifier: Apache-2.0
// The command line as a user runs it, for tests. WARMFRONT_BINARY is the path of `warmfront`. One thread at a
// time.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command.h"

namespace warmfront::client {

using Outcome = test::CommandOutcome;

/// Runs `warmfront ARGUMENTS` in a shell; `streams` says what happens to stdout and stderr.
inline Outcome run(const std::string& arguments, const std::string& streams = "2>&1") {
  return test::run_command(std::string(WARMFRONT_BINARY) + " " + arguments + " " + streams);
}

inline std::vector<std::string> keys(const nlohmann::ordered_json& object) {
  std::vector<std::string> names;
  for (const auto& item : object.items()) names.push_back(item.key());
  return names;
}

}  // namespace warmfront::client
