// SPDX-License-Identifier: Apache-2.0
// TOML by toml++. Thread safety as stated in the header.
#include "server/config_file.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/digits.h"
#include "server/process/small_file.h"

namespace warmfront::server {
namespace {

std::optional<std::string> scalar_text(const toml::node& node) {
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  if (const auto* number = node.as_floating_point(); number != nullptr && std::isfinite(number->get()))
    return digits_of(number->get());
  if (const auto* boolean = node.as_boolean()) return boolean->get() ? "true" : "false";
  return std::nullopt;
}

std::optional<std::vector<std::string>> values_of(const toml::node& node) {
  std::vector<std::string> values;
  if (std::optional<std::string> one = scalar_text(node)) return std::vector{*std::move(one)};
  const toml::array* list = node.as_array();
  if (list == nullptr) return std::nullopt;
  for (const toml::node& item : *list) {
    std::optional<std::string> text = scalar_text(item);
    if (!text) return std::nullopt;
    values.push_back(*std::move(text));
  }
  return values;
}

std::string why_not(const toml::key& key, const toml::node& node) {
  const std::string name(key.str());
  const auto* array = node.as_array();
  if (node.is_table() || (array != nullptr && !array->empty() && array->front().is_table()))
    return "[" + name +
           "] is a table, and tables are not supported: write its keys "
           "without it, as in max-sessions = 8; --print-config lists them";
  return name + ": text, a number, true or false, or a list of these is expected";
}

}  // namespace

std::string place_of(const std::string& path, unsigned line) {
  return path + ": line " + std::to_string(line);
}

Result<ConfigFile> read_config_file(const std::string& path) {
  const Result<std::string> text = read_small_file("config", path);
  if (!text) return text.error();
  try {
    const toml::table table = toml::parse(text.value(), path);
    ConfigFile file;
    for (const auto& [key, node] : table) {
      const unsigned line = key.source().begin.line;
      std::optional<std::vector<std::string>> found = values_of(node);
      if (found) {
        file.values.emplace(key.str(), *std::move(found));
        file.lines.emplace(key.str(), line);
      } else {
        file.mistakes.emplace(line, why_not(key, node));
      }
    }
    return file;
  } catch (const toml::parse_error& error) {
    const std::string what(error.description());
    const bool twice = what.find("redefine") != std::string::npos;
    return invalid_argument(place_of(path, error.source().begin.line) + ": " + what +
                            (twice ? "" : "; text is written in quotes, as in log-level = \"debug\""));
  }
}

std::string toml_string(const std::string& text) {
  // JSON's escapes are TOML's; only the one control character above the blanks is not JSON's to escape.
  std::string quoted = nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  for (std::size_t at = 0; (at = quoted.find('\x7f', at)) != std::string::npos;)
    quoted.replace(at, 1, "\\u007f");
  return quoted;
}

bool is_plain_text(std::string_view text) {
  const bool control =
      std::any_of(text.begin(), text.end(), [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; });
  if (control) return false;
  try {
    static_cast<void>(nlohmann::json(text).dump());
    return true;
  } catch (const nlohmann::json::type_error&) {
    return false;  // no UTF-8
  }
}

}  // namespace warmfront::server
