// SPDX-License-Identifier: Apache-2.0
// Markdown tables: see markdown.h.
#include "client/cli/markdown.h"

#include <algorithm>

namespace warmfront::client {

std::string format_markdown_table(const std::vector<Cells>& rows, std::size_t words) {
  std::vector<std::size_t> width(rows.front().size());
  for (const Cells& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  }
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t c = 0; c < width.size(); ++c) {
      const std::string pad(width[c] - rows[r][c].size(), ' ');
      text += "| " + (c < words ? rows[r][c] + pad : pad + rows[r][c]) + " ";
    }
    text += "|\n";
    if (r > 0) continue;
    for (std::size_t c = 0; c < width.size(); ++c)
      text += c < words ? "|-" + std::string(width[c], '-') + "-" : "|-" + std::string(width[c], '-') + ":";
    text += "|\n";
  }
  return text;
}

}  // namespace warmfront::client
