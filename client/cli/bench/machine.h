// SPDX-License-Identifier: Apache-2.0
// The machine and build of a measurement. Thread-safe: reads constants and the system's files.
#pragma once

#include <cstdint>
#include <string>

namespace warmfront::client {

struct BenchMachine {
  std::string cpu;  ///< model name; "unknown" if the system does not say
  int cores = 0;    ///< threads that the engine uses by default
  std::uint64_t memory_bytes = 0;
};

struct BenchBuild {
  std::string version;   ///< of the project
  std::string revision;  ///< of the sources when the build was configured; empty outside a repository
  std::string compiler;
  std::string type;          ///< CMake's build type
  std::string flags;         ///< given on top of the project's own
  std::string instructions;  ///< what hot loops are compiled for, chosen at run time: "arch=x86-64-v4 avx2
                             ///< default"; or "baseline"
};

BenchMachine this_machine();
BenchBuild this_build();

}  // namespace warmfront::client
