// SPDX-License-Identifier: Apache-2.0
// What the hot loops are compiled for, and whether this machine has it. Thread-safe.
#pragma once

#include <string>

namespace warmfront {

/// The instruction sets that hot loops are compiled for, of which one is chosen when the program is loaded:
/// "arch=x86-64-v4 avx2 default"; "baseline" where there is one alone. Answers are the same bits with each.
std::string instruction_sets();

/// Whether a program whose hot loops are compiled for the baseline alone is faster on this machine.
bool baseline_is_faster() noexcept;

/// Why hot loops take many times as long on this machine as they could, and what to do about it; empty where
/// they do not.
std::string why_instructions_are_slow();

}  // namespace warmfront
