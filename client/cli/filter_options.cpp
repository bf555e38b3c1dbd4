// SPDX-License-Identifier: Apache-2.0
// Filters from the command line: see filter_options.h.
#include "client/cli/filter_options.h"

#include <CLI/CLI.hpp>
#include <limits>
#include <utility>

#include "client/io/file.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

bool is_blank(std::string_view line) {
  return next_word(line).empty();
}

/// One number, with blanks around it or none.
bool parse_index(std::string_view text, std::uint32_t& value) {
  std::uint64_t number = 0;
  if (!parse_number(next_word(text), number) || !is_blank(text) ||
      number > std::numeric_limits<std::uint32_t>::max())
    return false;
  value = static_cast<std::uint32_t>(number);
  return true;
}

}  // namespace

Result<std::vector<std::array<std::uint32_t, 2>>> parse_vertex_pairs(std::string_view text,
                                                                     std::string_view file) {
  std::vector<std::array<std::uint32_t, 2>> pairs;
  LineScanner lines(text);
  for (std::string_view line; lines.next(line);) {
    if (is_blank(line)) continue;
    std::array<std::uint32_t, 2> pair;
    const std::size_t comma = line.find(',');
    if (comma == std::string_view::npos || !parse_index(line.substr(0, comma), pair[0]) ||
        !parse_index(line.substr(comma + 1), pair[1]))
      return error_at_line(file, lines.line_number(), in_quotes(line) + " is no pair of vertices; write V,W");
    pairs.push_back(pair);
  }
  return pairs;
}

Result<std::vector<std::uint32_t>> parse_patches(std::string_view text, std::string_view file) {
  std::vector<std::uint32_t> patches;
  LineScanner lines(text);
  for (std::string_view line; lines.next(line);) {
    if (is_blank(line)) continue;
    std::uint32_t patch = 0;
    if (!parse_index(line, patch))
      return error_at_line(
          file, lines.line_number(),
          in_quotes(line) + " is no patch; write a number below 2^32 for each vertex, 0 for none");
    patches.push_back(patch);
  }
  return patches;
}

void add_filter_options(CLI::App& app, FilterArguments& arguments) {
  app.add_option("--filter-edges", arguments.within_edges,
                 "Leave out pairs of features with vertices at most so many edges of the mesh apart; 0 to 3")
      ->check(CLI::Range(0U, PairFilters::kMostEdges));
  app.add_option(
         "--filter-near-at-rest", arguments.near_at_rest,
         "Leave out pairs of features at most so far apart in the input's first frame, in the scene's unit; "
         "0: none")
      ->check(CLI::NonNegativeNumber);
  app.add_option(
         "--filter-pairs", arguments.pairs_file,
         "Leave out pairs of features with a vertex V of one and a vertex W of the other: a line V,W for "
         "each")
      ->type_name("FILE");
  app.add_option(
         "--filter-patches", arguments.patches_file,
         "Leave out pairs of features whose vertices are all in one patch: a line with the patch's number "
         "for each vertex, 0 for none")
      ->type_name("FILE");
}

Status take_filters(const FilterArguments& arguments, Input& input, SceneDescription& scene) {
  PairFilters& filters = scene.filters;
  if (arguments.within_edges) filters.within_edges = *arguments.within_edges;
  if (!arguments.pairs_file.empty()) {
    const Result<std::string> text = read_file(arguments.pairs_file);
    if (!text) return text.error();
    auto pairs = parse_vertex_pairs(text.value(), arguments.pairs_file);
    if (!pairs) return pairs.error();
    filters.excluded_vertex_pairs = std::move(pairs).value();
  }
  if (!arguments.patches_file.empty()) {
    const Result<std::string> text = read_file(arguments.patches_file);
    if (!text) return text.error();
    auto patches = parse_patches(text.value(), arguments.patches_file);
    if (!patches) return patches.error();
    if (patches.value().size() != scene.vertex_count)
      return invalid_argument(arguments.patches_file + ": " + std::to_string(patches.value().size()) +
                              " lines, but the scene has " + std::to_string(scene.vertex_count) +
                              " vertices");
    filters.patches = std::move(patches).value();
  }
  if (!arguments.near_at_rest) return {};
  filters.near_at_rest = *arguments.near_at_rest;
  if (filters.near_at_rest == 0) filters.rest_positions.clear();
  return rest_at_first_frame(input, scene);
}

}  // namespace warmfront::client
