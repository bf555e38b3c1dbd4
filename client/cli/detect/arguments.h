// SPDX-License-Identifier: Apache-2.0
// The arguments of `detect`, as given and checked. Used by the main thread only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/detect/outputs.h"
#include "client/cli/filter_options.h"
#include "client/lib/client.h"
#include "engine/options.h"

namespace CLI {
class App;
}  // namespace CLI

namespace warmfront::client {

/// The arguments as given.
struct DetectArguments {
  std::vector<std::string> inputs;
  bool remeshed = false;  ///< mesh files may differ in topology
  std::string server;
  ClientOptions connection;
  std::string tier{to_string(ColliderOptions{}.tier)};
  std::string report{to_string(ColliderOptions{}.report)};
  std::string front{to_string(ColliderOptions{}.front)};
  std::string bounds{to_string(ColliderOptions{}.bounds)};
  std::string lazy = ColliderOptions{}.lazy_front ? "on" : "off";
  std::string normal_cones = ColliderOptions{}.normal_cones ? "on" : "off";
  ColliderOptions options;
  int threads = 0;
  std::uint32_t substeps = 1;
  std::string bodies = "declared";
  std::string send;  ///< as parse_send_mode() takes it
  std::vector<std::string> fields;
  std::string find_bodies = "on";
  std::string find_rigid = "on";
  std::string separate_parts = "on";
  std::string frames;
  FilterArguments filters;
  std::size_t in_flight = 2;
  OutputFiles files;
  std::string json_file;
  std::string record_file;

  /// Is one of the outputs stdout, which must then carry nothing else?
  bool takes_stdout() const { return json_file == "-" || files.contacts == "-" || files.html.file == "-"; }
};

/// Adds the options to `app`, which sets `arguments` when it parses; these outlive it.
void add_detect_options(CLI::App& app, DetectArguments& arguments);
/// Checks the arguments without opening anything, and parses the names among them into options.
Status check_usage(DetectArguments& arguments);
/// Of an input whose topology changes: options that need one that stays are refused.
Status check_topology_changes(const DetectArguments& arguments);

}  // namespace warmfront::client
