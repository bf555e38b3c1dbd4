// SPDX-License-Identifier: Apache-2.0
// The option --fields: see contact_fields.h.
#include "client/cli/contact_fields.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <utility>

#include "client/cli/verb.h"

namespace warmfront::client {
namespace {

constexpr std::array<std::pair<const char*, bool ContactFields::*>, 6> kFields{
    {{"weights", &ContactFields::weights},
     {"normal", &ContactFields::normal},
     {"points", &ContactFields::points},
     {"direction", &ContactFields::direction},
     {"squared_distance", &ContactFields::squared_distance},
     {"closest", &ContactFields::closest}}};

}  // namespace

CLI::Option* add_fields_option(CLI::App& app, std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const auto& [name, member] : kFields) known.emplace_back(name);
  return take_list(app.add_option("--fields", names,
                                  "Further fields of --contacts: weights (barycentric coordinates), normal "
                                  "(of the face, or of both edges), points (the closest points), direction "
                                  "(between these), squared_distance (of these), closest (which features "
                                  "they are on: vv, ev, ee, fv)"))
      ->check(CLI::IsMember(known));
}

ContactFields fields_named(const std::vector<std::string>& names) {
  ContactFields fields;
  for (const auto& [name, member] : kFields) fields.*member = std::ranges::find(names, name) != names.end();
  return fields;
}

}  // namespace warmfront::client
