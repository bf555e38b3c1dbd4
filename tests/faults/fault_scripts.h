// SPDX-License-Identifier: Apache-2.0
// The scripts whose operations every_place_test.cpp makes fail: short, and together of every kind of
// operation. Pure functions.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/accepted_state.h"

namespace warmfront::testing {

struct Script {
  std::string name;
  AcceptedState start;
  ColliderOptions options;
  std::vector<Operation> operations;
  std::size_t first = 0;  // that meets failures
};

inline void PrintTo(const Script& script, std::ostream* out) {
  *out << script.name;
}

/// Those by hand, and $WARMFRONT_FAULT_SEEDS (6) at random.
std::vector<Script> fault_scripts();

}  // namespace warmfront::testing
