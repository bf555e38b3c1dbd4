// SPDX-License-Identifier: Apache-2.0
// The command line as a user runs it, for tests. WARMFRONT_BINARY is the path of `warmfront`. One thread at a
// time.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace warmfront::client {

struct Outcome {
  int code = -1;
  std::string out;
};

/// Runs `warmfront ARGUMENTS` in a shell; `streams` says what happens to stdout and stderr.
inline Outcome run(const std::string& arguments, const std::string& streams = "2>&1") {
  const std::string command = std::string(WARMFRONT_BINARY) + " " + arguments + " " + streams;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), [](FILE*) { return 0; });
  Outcome outcome;
  std::array<char, 4096> block;
  while (const std::size_t got = fread(block.data(), 1, block.size(), pipe.get()))
    outcome.out.append(block.data(), got);
  const int status = pclose(pipe.get());
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

inline std::vector<std::string> keys(const nlohmann::ordered_json& object) {
  std::vector<std::string> names;
  for (const auto& item : object.items()) names.push_back(item.key());
  return names;
}

}  // namespace warmfront::client
