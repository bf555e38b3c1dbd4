// SPDX-License-Identifier: Apache-2.0
// A program goes on as the one beside it that is made for machines without AVX2. For the beginning of main(),
// before there is another thread.
#pragma once

#include <limits.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "engine/instructions.h"

namespace warmfront::command_line {

/// Where this machine has no AVX2, or WARMFRONT_INSTRUCTIONS is "baseline", and the folder
/// ../libexec/warmfront beside this program's has one of its name, this process becomes that, with the same
/// arguments. Otherwise, and in that program, it returns. Other values of the variable end it with exit
/// code 3.
inline void become_baseline_build(char** arguments) {
  const char* const asked = std::getenv("WARMFRONT_INSTRUCTIONS");
  const bool given = asked != nullptr && *asked != '\0';
  const bool wanted = given && std::string_view(asked) == "baseline";
  if (given && !wanted) {
    constexpr int kUsage = 3;
    std::fprintf(stderr, "WARMFRONT_INSTRUCTIONS: \"%s\": give \"baseline\", or leave it out\n", asked);
    std::exit(kUsage);
  }
  if (!baseline_is_faster() && !(wanted && instruction_sets() != "baseline")) return;
  std::array<char, PATH_MAX> self{};
  const ssize_t length = ::readlink("/proc/self/exe", self.data(), self.size());
  if (length <= 0 || length == static_cast<ssize_t>(self.size())) return;
  const std::string path(self.data(), static_cast<std::size_t>(length));
  const std::size_t name = path.rfind('/');
  const std::size_t folder = name == 0 ? std::string::npos : path.rfind('/', name - 1);
  if (name == std::string::npos || folder == std::string::npos) return;
  const std::string other = path.substr(0, folder) + "/libexec/warmfront" + path.substr(name);
  if (::access(other.c_str(), X_OK) != 0) return;
  ::unsetenv("WARMFRONT_INSTRUCTIONS");  // which is no setting of the daemon
  ::execv(other.c_str(), arguments);
}

}  // namespace warmfront::command_line
