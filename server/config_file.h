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
  std::map<std::string, unsigned> lines;                   ///< of the same keys
  /// By line: a table, and a value that is neither text, number, boolean nor a list of these; without `path`
  /// and line.
  std::multimap<unsigned, std::string> mistakes;
};

/// The file's keys. INVALID_ARGUMENT, naming `path` and the line, for a file that cannot be read or is no
/// TOML, and a key twice. Whether the keys are settings is for the caller to say.
Result<ConfigFile> read_config_file(const std::string& path);

/// How a line of a file is called in messages.
std::string place_of(const std::string& path, unsigned line);

/// `text` as a TOML string, quotes included; what is no UTF-8 comes out replaced.
std::string toml_string(const std::string& text);

/// Whether TOML can hold `text` and a person can read it: UTF-8 without control characters.
bool is_plain_text(std::string_view text);

}  // namespace warmfront::server
