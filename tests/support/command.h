// SPDX-License-Identifier: Apache-2.0
// Runs programs as a user does, for tests. One thread at a time.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <memory>
#include <string>

namespace warmfront::test {

struct CommandOutcome {
  int code = -1;
  std::string out;
};

/// Runs a command in a shell.
inline CommandOutcome run_command(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), [](FILE*) { return 0; });
  CommandOutcome outcome;
  std::array<char, 4096> block;
  while (const std::size_t got = fread(block.data(), 1, block.size(), pipe.get()))
    outcome.out.append(block.data(), got);
  const int status = pclose(pipe.get());
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

}  // namespace warmfront::test
