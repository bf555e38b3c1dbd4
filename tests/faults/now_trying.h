// SPDX-License-Identifier: Apache-2.0
// For crashes: a process that ends without a test's verdict says in which case it was.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

namespace warmfront::testing {

inline std::string now_trying;  // NOLINT: read by the handler below

[[noreturn]] inline void tell_and_end() {
  std::fprintf(stderr, "the process ended in: %s\n", now_trying.c_str());
  std::abort();
}
inline const auto tells_at_the_end = std::set_terminate(tell_and_end);

}  // namespace warmfront::testing
