// SPDX-License-Identifier: Apache-2.0
// The options --html and --html-limit: see html_options.h.
#include "client/cli/html/html_options.h"

#include <CLI/CLI.hpp>

namespace warmfront::client {

void add_html_options(CLI::App& app, HtmlArguments& arguments, const std::string& shows) {
  CLI::Option* html =
      app.add_option("--html", arguments.file, "Write one self-contained page: " + shows)->type_name("FILE");
  app.add_option("--html-limit", arguments.limit, "Maximum size of the data in --html; beyond it, an error")
      ->transform(CLI::AsSizeValue(false))
      ->default_str("64MiB")
      ->needs(html);
}

}  // namespace warmfront::client
