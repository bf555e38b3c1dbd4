// SPDX-License-Identifier: Apache-2.0
// The table of warmfrontd's settings: one row is a flag, a variable, a key of the file and a line of
// --print-config. Constant.
#pragma once

#include <functional>
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
  /// INVALID_ARGUMENT, without the setting's name, for what is no value of it; one value unless it is a list.
  std::function<Status(Config& config, const std::vector<std::string>& values)> set;
  std::function<std::vector<std::string>(const Config& config)> get;
  const char* former_name = nullptr;  ///< under which it is still taken, with a remark; null: none
};

/// In the order of --help. Thread-safe, and the same at each call.
std::span<const Setting> settings();

}  // namespace warmfront::server
