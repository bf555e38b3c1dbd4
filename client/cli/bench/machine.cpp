// SPDX-License-Identifier: Apache-2.0
// Machine and build: see bench_machine.h.
#include "client/cli/bench/machine.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "engine/instructions.h"
#include "engine/workers.h"

namespace warmfront::client {
namespace {

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

std::string compiler() {
#if defined(__clang__)
  return "Clang " __clang_version__;
#else
  return "GCC " __VERSION__;
#endif
}

}  // namespace

BenchMachine this_machine() {
  const auto pages = std::max(sysconf(_SC_PHYS_PAGES), 0L);
  const auto page = std::max(sysconf(_SC_PAGESIZE), 0L);
  return {cpu_model(), Workers().threads(),
          static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page)};
}

BenchBuild this_build() {
  return {WARMFRONT_VERSION,    WARMFRONT_REVISION,    compiler(),
          WARMFRONT_BUILD_TYPE, WARMFRONT_BUILD_FLAGS, instruction_sets()};
}

}  // namespace warmfront::client
