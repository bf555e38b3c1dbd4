// SPDX-License-Identifier: Apache-2.0
// Output of `warmfront bench`: tables, CSV, JSON. Pure functions.
#pragma once

#include <span>
#include <string>

#include "client/cli/bench/machine.h"
#include "client/cli/bench/run.h"

namespace warmfront::client {

/// Data common to all inputs.
struct BenchContext {
  BenchMachine machine;
  BenchBuild build;
  std::uint32_t rounds = 0;  ///< 0: times are of none
};

/// Two lines that name machine and build.
std::string format_bench_context(const BenchContext& context);

/// One input for people: times, counts, thread scaling (the paper's Table 1), savings of the front.
std::string format_bench_tables(const BenchReport& report);

/// One input as a diagram: its settings as bars, stage by stage.
std::string format_bench_svg(const BenchReport& report);

/// The CSV file with its header: a line for each input and setting.
std::string format_bench_csv(const BenchContext& context, std::span<const BenchReport> reports);
/// {"machine", "build", "rounds", "inputs": [{..., "settings": [...]}]}.
std::string format_bench_json(const BenchContext& context, std::span<const BenchReport> reports);

}  // namespace warmfront::client
