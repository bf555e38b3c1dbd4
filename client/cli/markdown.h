// SPDX-License-Identifier: Apache-2.0
// Tables for terminals and documents. Pure functions.
#pragma once

#include <string>
#include <vector>

namespace warmfront::client {

using Cells = std::vector<std::string>;

/// Rows of equally many cells as an aligned Markdown table, the first row as its head: the first `words`
/// columns left-aligned, the others, numbers, right-aligned.
std::string format_markdown_table(const std::vector<Cells>& rows, std::size_t words);

}  // namespace warmfront::client
