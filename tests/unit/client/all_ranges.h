// SPDX-License-Identifier: Apache-2.0
// Reports of `warmfront detect --frames`, of all ranges of an input.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/exit_codes.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {

inline void expect_detected(const std::string& arguments) {
  const Outcome outcome = run("detect " + arguments);
  ASSERT_EQ(outcome.code, kExitOk) << arguments << "\n" << outcome.out;
}

/// Reports of all ranges of an input, each made when it is first asked for.
class AllRanges {
 public:
  static constexpr int kFrames = 7;

  std::string of(int first, int last) const {
    const std::string report = folder_.file(name(first, last) + ".json");
    if (!std::filesystem::exists(report))
      expect_detected(std::string("'builtin:bart?triangles=1000&frames=8' --min-separation 0.05 --frames ") +
                      std::to_string(first) + ":" + std::to_string(last) + " --json " + report +
                      " --contacts " + folder_.file(name(first, last) + ".csv"));
    return report;
  }
  nlohmann::ordered_json report(int first, int last) const {
    of(first, last);
    return nlohmann::ordered_json::parse(folder_.read(name(first, last) + ".json"));
  }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  static std::string name(int first, int last) { return std::to_string(first) + "-" + std::to_string(last); }

  TemporaryFolder folder_;
};

inline const AllRanges& all_ranges() {
  static const AllRanges kRanges;
  return kRanges;
}

}  // namespace warmfront::client
