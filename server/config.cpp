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
#include "server/config_remarks.h"
#include "server/settings.h"
#include "server/version.h"

namespace warmfront::server {
namespace {

constexpr int kExitUsage = 3;

struct Layer {
  Origin origin;
  std::map<std::string, std::vector<std::string>> values;  ///< by setting name
  std::function<std::string(const std::string&)> where;    ///< how a setting is called in this layer
  /// In a file; 0 elsewhere.
  std::function<unsigned(const std::string&)> line = [](const std::string&) { return 0U; };
};

/// In words, by their line.
using Mistakes = std::multimap<unsigned, std::string>;

/// All of them, each in a line of its own.
Status status_of(const Mistakes& mistakes) {
  std::string all;
  for (const auto& [line, why] : mistakes) all.append(all.empty() ? "" : "\nwarmfrontd: ").append(why);
  return mistakes.empty() ? Status{} : invalid_argument(all);
}

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
  Layer layer{.origin = Origin::kEnvironment, .values = {}, .where = variable_of};
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
  std::set<std::string> known{variable_of("config"), variable_of("data")};  // the latter is of tests
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

/// Sets what `layer` has. What it cannot set is a mistake, by line; all are looked at.
void apply(const Layer& layer, ResolvedConfig& resolved, Mistakes& mistakes) {
  std::size_t row = 0;
  for (const Setting& setting : settings()) {
    Origin& origin = resolved.origins[row++];
    for (const std::string& name : names_of(setting)) {
      const auto found = layer.values.find(name);
      if (found == layer.values.end()) continue;
      const std::vector<std::string>& values = found->second;
      const auto wrong = [&](const std::string& why) {
        mistakes.emplace(layer.line(name), layer.where(name) + ": " + why);
      };
      if (name != setting.name) {
        const std::string now = layer.where(setting.name);
        if (layer.values.contains(setting.name)) {
          wrong("it is the former name of " + now + ", which is set too");
          continue;
        }
        resolved.remarks.push_back(layer.where(name) + ": its name is " + now +
                                   " now; the former one will go");
      }
      if (setting.kind != Setting::Kind::kList && values.size() != 1)
        wrong("one value is expected");
      else if (!std::ranges::all_of(values, is_plain_text))
        wrong("UTF-8 text without control characters is expected");
      else if (const Status set = setting.set(resolved.config, values); !set)
        wrong(set.error().message);
      else
        origin = layer.origin;
    }
  }
}

Status apply_file(const std::string& path, ResolvedConfig& resolved) {
  const Result<ConfigFile> read = read_config_file(path);
  if (!read) return read.error();
  const ConfigFile& file = read.value();
  const auto line = [&file](const std::string& name) {
    const auto found = file.lines.find(name);
    return found == file.lines.end() ? 0 : found->second;
  };
  const auto where = [&](const std::string& name) {
    return (line(name) == 0 ? path : place_of(path, line(name))) + ": " + name;
  };
  Mistakes mistakes;
  for (const auto& [at, why] : file.mistakes) mistakes.emplace(at, place_of(path, at) + ": " + why);
  for (const auto& [name, at] : file.lines)
    if (!is_setting(name)) mistakes.emplace(at, where(name) + " is no setting; " + meant_by(name));
  apply({Origin::kFile, file.values, where, line}, resolved, mistakes);
  return status_of(mistakes);
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
  if (!path.empty())
    if (const Status applied = apply_file(path, resolved); !applied) return applied;
  if (const Status checked = check_variables(environment, resolved.remarks); !checked) return checked;
  Mistakes mistakes;
  apply(environment_layer(environment), resolved, mistakes);
  apply(flags, resolved, mistakes);
  return status_of(mistakes);
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
  const Layer flag_layer{.origin = Origin::kFlag,
                         .values = std::move(flags),
                         .where = [](const std::string& name) { return "--" + name; }};
  if (const Status applied = apply_layers(flag_layer, environment, path, resolved); !applied) {
    err << "warmfrontd: " << applied.error().message << "\n";
    return kExitUsage;
  }
  for (std::string& remark : contradictions(resolved.config)) resolved.remarks.push_back(std::move(remark));
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
