// SPDX-License-Identifier: Apache-2.0
// What tests of traces share: callers' spans, and the spans of a request of OTLP's JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace warmfront::test {

inline constexpr const char* kSampled = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";
inline constexpr const char* kNotSampled = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-00";

inline std::vector<nlohmann::json> spans_of(const std::string& request) {
  const nlohmann::json parsed = nlohmann::json::parse(request);
  return parsed.at("resourceSpans")
      .at(0)
      .at("scopeSpans")
      .at(0)
      .at("spans")
      .get<std::vector<nlohmann::json>>();
}

}  // namespace warmfront::test
