// SPDX-License-Identifier: Apache-2.0
// The option --fields of verbs that write contacts. Used by the main thread only.
#pragma once

#include <string>
#include <vector>

#include "engine/options.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace warmfront::client {

/// Defines --fields; `names` must outlive the parsing.
CLI::Option* add_fields_option(CLI::App& app, std::vector<std::string>& names);

/// Of names that the option took.
ContactFields fields_named(const std::vector<std::string>& names);

}  // namespace warmfront::client
