// SPDX-License-Identifier: Apache-2.0
// Any file, variables and flags of warmfrontd: refused as a usage error with words, or a configuration that
// says the same when it is printed and read again. One thread. The input is three parts with a zero byte
// between them: the file, variables (NAME=VALUE lines), flags (one a line).
#include <map>
#include <sstream>

#include "server/config.h"
#include "server/settings.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace warmfront;
using namespace warmfront::server;
using fuzz::expect;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::variant<ResolvedConfig, int> resolve(const std::vector<std::string>& flags,
                                          const std::map<std::string, std::string>& variables) {
  std::vector<const char*> arguments{"warmfrontd"};
  for (const std::string& flag : flags) arguments.push_back(flag.c_str());
  std::ostringstream out, err;
  auto resolved = resolve_config(static_cast<int>(arguments.size()), arguments.data(), variables, out, err);
  if (const int* code = std::get_if<int>(&resolved)) {
    expect(*code == 0 || *code == 3, "a process that is done says help or usage");
    expect(!out.str().empty() || !err.str().empty(), "and says it in words");
  }
  return resolved;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream parts(std::string(reinterpret_cast<const char*>(data), size));
  std::string file_text, variable_text, flag_text;
  std::getline(parts, file_text, '\0');
  std::getline(parts, variable_text, '\0');
  std::getline(parts, flag_text, '\0');

  const fuzz::MemoryFile file(file_text);
  std::map<std::string, std::string> variables;
  for (const std::string& line : lines_of(variable_text))
    if (const std::size_t equals = line.find('='); equals != std::string::npos)
      variables[line.substr(0, equals)] = line.substr(equals + 1);
  variables["WARMFRONT_CONFIG"] = file.path();
  std::vector<std::string> flags;
  // A flag that names another file would have the fuzzer read whatever the machine has.
  for (std::string& line : lines_of(flag_text))
    if (line.find("config") == std::string::npos || line == "--print-config")
      flags.push_back(std::move(line));

  const auto first = resolve(flags, variables);
  if (!std::holds_alternative<ResolvedConfig>(first)) return 0;
  const std::string printed = print_config(std::get<ResolvedConfig>(first));
  const fuzz::MemoryFile copy(printed);
  const auto second = resolve({"--config", copy.path()}, {});
  expect(std::holds_alternative<ResolvedConfig>(second), "what is printed can be read");
  for (const Setting& setting : settings())
    expect(setting.get(std::get<ResolvedConfig>(second).config) ==
               setting.get(std::get<ResolvedConfig>(first).config),
           "and is the same configuration");
  return 0;
}
