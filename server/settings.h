// SPDX-License-Identifier: Apache-2.0
// The table of warmfrontd's settings: one row is a flag, a variable, a key of the file and a line of
// --print-config. Constant.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/config.h"

namespace warmfront::server {

struct Setting {
  enum class Kind { kValue, kList, kSwitch };

  const char* name;  ///< as a flag and in the file; WARMFRONT_ and upper case as a variable
  Kind kind;
  const char* help;
  Status (*set)(Config& config, const std::vector<std::string>& values);
  std::vector<std::string> (*get)(const Config& config);
};

std::span<const Setting> settings();

}  // namespace warmfront::server
