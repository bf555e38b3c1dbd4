// SPDX-License-Identifier: Apache-2.0
#include "client/cli/json_rows.h"

#include "client/io/text.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

std::string in_csv(const Json& field) {
  if (field.is_null()) return "";
  return field.is_string() ? csv_field(field.get_ref<const std::string&>()) : field.dump();
}

}  // namespace

std::string csv_of(const Json& like, std::span<const Json> rows) {
  std::string text;
  const auto append = [&](const Json& row, auto&& field) {
    const char* separator = "";
    for (const auto& item : row.items()) {
      text += separator + field(item);
      separator = ",";
    }
    text += "\n";
  };
  append(like, [](const auto& item) { return item.key(); });
  for (const Json& row : rows) append(row, [](const auto& item) { return in_csv(item.value()); });
  return text;
}

}  // namespace warmfront::client
