// SPDX-License-Identifier: Apache-2.0
// Both programs' message for an unknown argument: its name, and the nearest known one. Pure functions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace warmfront::command_line {

/// Optimal string alignment distance: insertions, deletions, replacements and swaps of neighbours. O(a.size()
/// b.size()).
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

/// The name nearest to `word` within a third of its length, the first of several; empty for none.
inline std::string_view nearest(std::string_view word, std::span<const std::string> names) {
  std::string_view best;
  std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& name : names) {
    const std::size_t distance = edit_distance(word, name);
    if (distance >= least) continue;
    least = distance;
    best = name;
  }
  return best;
}

/// For unparsed arguments, in order: "there is no option --sesions; the nearest is --sessions". `options` are
/// the long names with their dashes. Arguments after an unknown option are ignored, since they may be its
/// value.
inline std::string unknown_argument(std::span<const std::string> left_over,
                                    std::span<const std::string> options) {
  const auto is_option = [](const std::string& argument) {
    return argument.size() > 1 && argument.starts_with('-');
  };
  const auto unknown = std::ranges::find_if(left_over, is_option);
  if (unknown == left_over.end())
    return left_over.empty() ? "an argument is one too many"
                             : "the argument '" + left_over.front() + "' is one too many";
  const std::string name = unknown->substr(0, unknown->find('='));
  const std::string_view meant = nearest(name, options);
  return "there is no option " + name + (meant.empty() ? "" : "; the nearest is " + std::string(meant));
}

}  // namespace warmfront::command_line
