// SPDX-License-Identifier: Apache-2.0
// The layers of configuration, one over the other. Thread-safe.
#include "server/config.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <sstream>
#include <utility>

#include "proto/command_line/unknown_option.h"
#include "server/config_file.h"
#include "server/settings.h"
#include "server/version.h"

namespace warmfront::server {
namespace {

constexpr int kExitUsage = 3;

struct Layer {
  Origin origin;
  std::map<std::string, std::vector<std::string>> values;  ///< by setting name
  std::function<std::string(const std::string&)> where;    ///< how a setting is called in this layer
};

constexpr std::string_view kPrefix = "WARMFRONT_";

std::string variable_of(const std::string& name) {
  std::string variable = std::string(kPrefix) + name;
  for (char& c : variable)
    c = c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return variable;
}

std::vector<std::string> split_list(const std::string& text) {
  std::vector<std::string> items;
  std::istringstream in(text);
  for (std::string item; std::getline(in, item, ',');)
    if (!item.empty()) items.push_back(item);
  return items;
}

/// A list's flag may be repeated, and hold commas: both are the same.
std::vector<std::string> split_lists(const std::vector<std::string>& texts) {
  std::vector<std::string> items;
  for (const std::string& text : texts) {
    const std::vector<std::string> some = split_list(text);
    items.insert(items.end(), some.begin(), some.end());
  }
  return items.empty() ? texts : items;
}

const Setting* find_setting(const std::string& name) {
  for (const Setting& setting : settings())
    if (setting.name == name) return &setting;
  return nullptr;
}

Layer environment_layer(const Environment& environment) {
  Layer layer{Origin::kEnvironment, {}, variable_of};
  for (const Setting& setting : settings()) {
    const auto found = environment.find(variable_of(setting.name));
    if (found == environment.end()) continue;
    layer.values[setting.name] =
        setting.kind == Setting::Kind::kList ? split_list(found->second) : std::vector{found->second};
  }
  return layer;
}

/// The names that are no settings'.
Status check_variables(const Environment& environment, std::vector<std::string>& remarks) {
  std::vector<std::string> names{variable_of("config").substr(kPrefix.size())};
  for (const Setting& setting : settings()) names.push_back(variable_of(setting.name).substr(kPrefix.size()));
  std::string others;
  for (const auto& [variable, value] : environment) {
    if (!variable.starts_with(kPrefix)) continue;
    const std::string name = variable.substr(kPrefix.size());
    const std::string_view nearest = command_line::nearest(name, names);
    if (nearest == name) continue;
    if (!nearest.empty())
      return invalid_argument(variable + " is no setting's variable; the nearest is " + std::string(kPrefix) +
                              std::string(nearest));
    others.append(others.empty() ? "" : ", ").append(variable);
  }
  if (!others.empty()) remarks.push_back(others + ": no setting has a variable of such a name; ignored");
  return {};
}

Result<Layer> file_layer(const std::string& path) {
  Layer layer{Origin::kFile, {}, [path](const std::string& name) { return path + ": " + name; }};
  auto values = read_config_file(path);
  if (!values) return values.error();
  for (const auto& [name, ignored] : values.value()) {
    if (find_setting(name) != nullptr) continue;
    std::string meant = name;
    std::ranges::replace(meant, '_', '-');
    return invalid_argument(
        path + ": " + name + " is no setting; " +
        (find_setting(meant) != nullptr ? "it is " + meant + " in a file" : "--print-config lists them"));
  }
  layer.values = std::move(values).value();
  return layer;
}

Status apply(const Layer& layer, ResolvedConfig& resolved) {
  std::size_t row = 0;
  for (const Setting& setting : settings()) {
    Origin& origin = resolved.origins[row++];
    const auto found = layer.values.find(setting.name);
    if (found == layer.values.end()) continue;
    const std::vector<std::string>& values = found->second;
    if (setting.kind != Setting::Kind::kList && values.size() != 1)
      return invalid_argument(layer.where(setting.name) + ": one value is expected");
    if (!std::ranges::all_of(values, is_plain_text))
      return invalid_argument(layer.where(setting.name) +
                              ": UTF-8 text without control characters is expected");
    if (const Status set = setting.set(resolved.config, values); !set)
      return invalid_argument(layer.where(setting.name) + ": " + set.error().message);
    origin = layer.origin;
  }
  return {};
}

const char* name_of(Origin origin) {
  switch (origin) {
    case Origin::kDefault:
      return "default";
    case Origin::kFile:
      return "file";
    case Origin::kEnvironment:
      return "environment";
    case Origin::kFlag:
      return "flag";
  }
  return "";
}

Status apply_layers(const Layer& flags, const Environment& environment, const std::string& path,
                    ResolvedConfig& resolved) {
  if (!path.empty()) {
    const Result<Layer> file = file_layer(path);
    if (!file) return file.error();
    if (const Status applied = apply(file.value(), resolved); !applied) return applied;
  }
  if (const Status checked = check_variables(environment, resolved.remarks); !checked) return checked;
  if (const Status applied = apply(environment_layer(environment), resolved); !applied) return applied;
  return apply(flags, resolved);
}

}  // namespace

Environment warmfront_variables(const char* const* variables) {
  Environment found;
  for (; *variables != nullptr; ++variables) {
    const std::string_view variable = *variables;
    const std::size_t equals = variable.find('=');
    if (variable.starts_with(kPrefix) && equals != std::string_view::npos)
      found.emplace(variable.substr(0, equals), variable.substr(equals + 1));
  }
  return found;
}

std::variant<ResolvedConfig, int> resolve_config(int argc, const char* const* argv,
                                                 const Environment& environment, std::ostream& out,
                                                 std::ostream& err) {
  CLI::App app(
      "The Warmfront daemon: keeps collision sessions warm and answers their frames over gRPC.\n"
      "Every setting is a flag, a variable (WARMFRONT_ and upper case, e.g. WARMFRONT_MAX_SESSIONS) and a "
      "key of the\n"
      "TOML file; flags come first, then variables, then the file.",
      "warmfrontd");
  app.set_version_flag("--version", std::string("warmfrontd ") + kVersion);
  ResolvedConfig resolved;
  std::string path;
  app.add_option("--config", path, "TOML file of settings (WARMFRONT_CONFIG)")->type_name("FILE");
  app.add_flag("--print-config", resolved.print_only,
               "Print the configuration and where each value came from, and exit");

  std::map<std::string, std::vector<std::string>> flags;
  for (const Setting& setting : settings()) {
    const std::string flag = std::string("--") + setting.name;
    std::string help = setting.help;
    if (setting.kind == Setting::Kind::kSwitch) {
      app.add_flag_callback(
          flag, [&flags, &setting] { flags[setting.name] = {"true"}; }, help);
      continue;
    }
    std::vector<std::string> defaults = setting.get(Config{});
    help += " [" + (defaults.empty() ? "" : defaults.front()) + "]";
    app.add_option_function<std::vector<std::string>>(
           flag,
           [&flags, &setting](const std::vector<std::string>& values) {
             flags[setting.name] = setting.kind == Setting::Kind::kList ? split_lists(values) : values;
           },
           help)
        ->expected(setting.kind == Setting::Kind::kList ? -1 : 1)
        ->allow_extra_args(false)
        ->type_name("VALUE");
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError&) {
    std::vector<std::string> names{"--help", "--version", "--config", "--print-config"};
    for (const Setting& setting : settings()) names.push_back(std::string("--") + setting.name);
    err << "warmfrontd: " << command_line::unknown_argument(app.remaining(), names)
        << "; see 'warmfrontd --help'\n";
    return kExitUsage;
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, err) == 0 ? 0 : kExitUsage;
  }

  if (const auto found = environment.find("WARMFRONT_CONFIG"); path.empty() && found != environment.end())
    path = found->second;
  resolved.origins.assign(settings().size(), Origin::kDefault);
  const Layer flag_layer{Origin::kFlag, std::move(flags),
                         [](const std::string& name) { return "--" + name; }};
  if (const Status applied = apply_layers(flag_layer, environment, path, resolved); !applied) {
    err << "warmfrontd: " << applied.error().message << "\n";
    return kExitUsage;
  }
  return resolved;
}

std::string print_config(const ResolvedConfig& resolved) {
  std::string text;
  std::size_t row = 0;
  for (const Setting& setting : settings()) {
    text.append("# ")
        .append(setting.help)
        .append(" (from: ")
        .append(name_of(resolved.origins[row++]))
        .append(")\n");
    text.append(setting.name).append(" = ");
    const std::vector<std::string> values = setting.get(resolved.config);
    if (setting.kind == Setting::Kind::kList) {
      text.append("[");
      for (std::size_t i = 0; i < values.size(); ++i)
        text.append(i == 0 ? "" : ", ").append(toml_string(values[i]));
      text.append("]\n");
    } else if (setting.kind == Setting::Kind::kSwitch) {
      text.append(values.front()).append("\n");
    } else {
      text.append(toml_string(values.front())).append("\n");
    }
  }
  return text;
}

}  // namespace warmfront::server
