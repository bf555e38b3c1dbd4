// SPDX-License-Identifier: Apache-2.0
// Tables that read well in a terminal and in a document. Pure functions.
#pragma once

#include <string>
#include <vector>

namespace warmfront::client {

using Cells = std::vector<std::string>;

/// Rows of equally many cells as an aligned Markdown table, the first row its head: the first `words` columns
/// to the left, the others, numbers, to the right.
std::string format_markdown_table(const std::vector<Cells>& rows, std::size_t words);

}  // namespace warmfront::client
