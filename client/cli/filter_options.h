// SPDX-License-Identifier: Apache-2.0
// The options --filter-* of verbs that ask about a scene: pairs of features that do not count. Used by the
// main thread only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "client/io/input.h"
#include "engine/scene.h"

namespace CLI {
class App;
}

namespace warmfront::client {

/// The arguments as given; what is not given is as the input has it.
struct FilterArguments {
  std::optional<std::uint32_t> within_edges;
  std::optional<double> near_at_rest;
  std::string pairs_file;
  std::string patches_file;
};

/// --filter-edges, --filter-near-at-rest, --filter-pairs and --filter-patches. `arguments` must outlive the
/// parsing.
void add_filter_options(CLI::App& app, FilterArguments& arguments);

/// Puts them into the scene, instead of the input's; the rest shape is the input's first frame. Fails when a
/// file cannot be read, or is no list as the help says; Scene::create() checks the numbers.
Status take_filters(const FilterArguments& arguments, Input& input, SceneDescription& scene);

/// Lines of two vertices, "V,W"; and of one number. Errors name `file` and the line.
Result<std::vector<std::array<std::uint32_t, 2>>> parse_vertex_pairs(std::string_view text,
                                                                     std::string_view file);
Result<std::vector<std::uint32_t>> parse_patches(std::string_view text, std::string_view file);

}  // namespace warmfront::client
