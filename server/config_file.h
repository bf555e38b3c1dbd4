// SPDX-License-Identifier: Apache-2.0
// The configuration file: TOML as text values by key. Thread-safe.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "engine/result.h"

namespace warmfront::server {

struct ConfigFile {
  std::map<std::string, std::vector<std::string>> values;  ///< as written after a flag; a list has several
  std::map<std::string, std::string> places;               ///< of the same keys: "PATH: line N"
};

/// The file's keys. INVALID_ARGUMENT, naming `path` and the line, for a file that cannot be read or is no
/// TOML, a key twice, a table, and a value that is neither text, integer, boolean nor a list of these.
/// Whether the keys are settings is for the caller to say.
Result<ConfigFile> read_config_file(const std::string& path);

/// `text` as a TOML string, quotes included; what is no UTF-8 comes out replaced.
std::string toml_string(const std::string& text);

/// Whether TOML can hold `text` and a person can read it: UTF-8 without control characters.
bool is_plain_text(std::string_view text);

}  // namespace warmfront::server
