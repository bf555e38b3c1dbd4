// SPDX-License-Identifier: Apache-2.0
// The layers of configuration, one over the other. Thread-safe.
#include "server/config.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <set>
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

/// The present one, then the former one if there is one.
std::vector<std::string> names_of(const Setting& setting) {
  std::vector<std::string> names{setting.name};
  if (setting.former_name != nullptr) names.emplace_back(setting.former_name);
  return names;
}

bool is_setting(const std::string& name) {
  return std::ranges::any_of(
      settings(), [&](const Setting& setting) { return std::ranges::count(names_of(setting), name) > 0; });
}

Layer environment_layer(const Environment& environment) {
  Layer layer{Origin::kEnvironment, {}, variable_of};
  for (const Setting& setting : settings()) {
    for (const std::string& name : names_of(setting)) {
      const auto found = environment.find(variable_of(name));
      if (found == environment.end()) continue;
      layer.values[name] =
          setting.kind == Setting::Kind::kList ? split_list(found->second) : std::vector{found->second};
    }
  }
  return layer;
}

/// Those whose names are no settings'.
Status check_variables(const Environment& environment, std::vector<std::string>& remarks) {
  std::set<std::string> known{variable_of("config")};
  std::vector<std::string> present{"CONFIG"};  // without the prefix, which would make all of them alike
  for (const Setting& setting : settings()) {
    present.push_back(variable_of(setting.name).substr(kPrefix.size()));
    for (const std::string& name : names_of(setting)) known.insert(variable_of(name));
  }
  std::string others;
  for (const auto& [variable, value] : environment) {
    if (!variable.starts_with(kPrefix) || known.contains(variable)) continue;
    const std::string_view nearest = command_line::nearest(variable.substr(kPrefix.size()), present);
    if (!nearest.empty())
      return invalid_argument(variable + " is no setting's variable; the nearest is " + std::string(kPrefix) +
                              std::string(nearest));
    others.append(others.empty() ? "" : ", ").append(variable);
  }
  if (!others.empty()) remarks.push_back(others + ": no setting has a variable of such a name; ignored");
  return {};
}

/// What a key of a file that is no setting may have meant.
std::string meant_by(std::string name) {
  std::ranges::replace(name, '_', '-');
  if (is_setting(name)) return "it is " + name + " in a file";
  std::vector<std::string> present;
  for (const Setting& setting : settings()) present.emplace_back(setting.name);
  const std::string_view nearest = command_line::nearest(name, present);
  return nearest.empty() ? "--print-config lists them" : "the nearest is " + std::string(nearest);
}

Result<Layer> file_layer(const std::string& path) {
  auto file = read_config_file(path);
  if (!file) return file.error();
  for (const auto& [name, place] : file.value().places)
    if (!is_setting(name)) return invalid_argument(place + ": " + name + " is no setting; " + meant_by(name));
  const auto where = [path, places = file.value().places](const std::string& name) {
    const auto place = places.find(name);
    return (place == places.end() ? path : place->second) + ": " + name;
  };
  return Layer{Origin::kFile, std::move(file.value().values), where};
}

Status apply(const Layer& layer, ResolvedConfig& resolved) {
  std::size_t row = 0;
  for (const Setting& setting : settings()) {
    Origin& origin = resolved.origins[row++];
    for (const std::string& name : names_of(setting)) {
      const auto found = layer.values.find(name);
      if (found == layer.values.end()) continue;
      const std::string where = layer.where(name);
      if (name != setting.name) {
        const std::string now = layer.where(setting.name);
        if (layer.values.contains(setting.name))
          return invalid_argument(where + ": it is the former name of " + now + ", which is set too");
        resolved.remarks.push_back(where + ": its name is " + now + " now; the former one will go");
      }
      const std::vector<std::string>& values = found->second;
      if (setting.kind != Setting::Kind::kList && values.size() != 1)
        return invalid_argument(where + ": one value is expected");
      if (!std::ranges::all_of(values, is_plain_text))
        return invalid_argument(where + ": UTF-8 text without control characters is expected");
      if (const Status set = setting.set(resolved.config, values); !set)
        return invalid_argument(where + ": " + set.error().message);
      origin = layer.origin;
    }
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

CLI::Option* add_flag(CLI::App& app, const Setting& setting, const std::string& name,
                      std::map<std::string, std::vector<std::string>>& flags) {
  const std::string flag = "--" + name;
  if (setting.kind == Setting::Kind::kSwitch)
    return app.add_flag_callback(
        flag, [&flags, name] { flags[name] = {"true"}; }, setting.help);
  const bool is_list = setting.kind == Setting::Kind::kList;
  const std::vector<std::string> defaults = setting.get(Config{});
  return app
      .add_option_function<std::vector<std::string>>(
          flag,
          [&flags, name, is_list](const std::vector<std::string>& values) {
            flags[name] = is_list ? split_lists(values) : values;
          },
          setting.help + (" [" + (defaults.empty() ? "" : defaults.front())) + "]")
      ->expected(is_list ? -1 : 1)
      ->allow_extra_args(false)
      ->type_name("VALUE");
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
  for (const Setting& setting : settings())
    for (const std::string& name : names_of(setting)) {
      CLI::Option* option = add_flag(app, setting, name, flags);
      if (name != setting.name) option->group("");  // not in the help
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
  if (resolved.print_only)  // what would be in force; a daemon that starts says it in its log
    for (std::string& reason : fit_to_memory(resolved.config.limits))
      resolved.remarks.push_back(std::move(reason));
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
