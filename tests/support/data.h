// SPDX-License-Identifier: Apache-2.0
// Location of the real data, and small readers for the tests that use it. The data is never part of the
// project.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace warmfront::testing {

/// $WARMFRONT_DATA, or the folder that development checkouts have beside them.
inline std::filesystem::path data_root() {
  const char* given = std::getenv("WARMFRONT_DATA");
  return given != nullptr ? std::filesystem::path(given) : std::filesystem::path(WARMFRONT_DEFAULT_DATA);
}

}  // namespace warmfront::testing

/// Skips the test, saying so, where `relative` is absent.
#define WARMFRONT_NEED_DATA(relative)                                                \
  if (!std::filesystem::exists(::warmfront::testing::data_root() / (relative)))      \
  GTEST_SKIP() << "no " << (::warmfront::testing::data_root() / (relative)).string() \
               << "; set WARMFRONT_DATA to the data's folder"
