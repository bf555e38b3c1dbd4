// SPDX-License-Identifier: Apache-2.0
// Rows of a table as CSV, from their JSON. Pure functions.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace warmfront::client {

/// A header of the fields' names, which `like` has, and a line a row; null is an empty field.
std::string csv_of(const nlohmann::ordered_json& like, std::span<const nlohmann::ordered_json> rows);

}  // namespace warmfront::client
