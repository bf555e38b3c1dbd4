// SPDX-License-Identifier: Apache-2.0
// What a daemon has logged as JSON, by event. Pure function.
#pragma once

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace warmfront::test {

/// In the order of the log, whose last line may not be whole.
inline std::vector<nlohmann::json> events_of(const std::string& log, const std::string& event) {
  std::vector<nlohmann::json> events;
  std::istringstream lines(log.substr(0, log.rfind('\n') + 1));
  for (std::string line; std::getline(lines, line);)
    if (auto fields = nlohmann::json::parse(line); fields["event"] == event)
      events.push_back(std::move(fields));
  return events;
}

}  // namespace warmfront::test
