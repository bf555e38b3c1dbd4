// SPDX-License-Identifier: Apache-2.0
// The options --html and --html-limit of verbs that write a page. Used by the main thread only.
#pragma once

#include <cstdint>
#include <string>

namespace CLI {
class App;
}

namespace warmfront::client {

/// The arguments as given; without a file, no page is written.
struct HtmlArguments {
  std::string file;
  std::uint64_t limit = std::uint64_t{64} << 20;  ///< bytes
};

/// Defines --html, whose help goes on with what the page shows, and --html-limit. `arguments` must outlive
/// the parsing.
void add_html_options(CLI::App& app, HtmlArguments& arguments, const std::string& shows);

}  // namespace warmfront::client
