// SPDX-License-Identifier: Apache-2.0
// Functions shared by the verbs: see verb.h.
#include "client/cli/verb.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>

#include "client/cli/exit_codes.h"
#include "client/io/file.h"
#include "client/io/mesh_file.h"
#include "client/io/point_cache.h"

namespace warmfront::client {
namespace {

int say(const std::string& message, int code) {
  std::fflush(stdout);
  std::fprintf(stderr, "warmfront: %s\n", message.c_str());
  return code;
}

}  // namespace

int failure(const std::string& message) {
  return say(message, kExitFailed);
}
int usage_error(const std::string& message) {
  return say(message, kExitUsage);
}

void print_notes(std::span<const std::string> notes) {
  for (const std::string& note : notes) say("note: " + note, kExitOk);
}

int finish_output() {
  errno = 0;
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return kExitOk;
  return failure("cannot write to stdout" + (errno == 0 ? "" : std::string(": ") + std::strerror(errno)));
}

std::string short_name(const std::string& path) {
  if (path.starts_with("builtin:")) return path.substr(8);
  const std::filesystem::path clean = std::filesystem::path(path).lexically_normal();
  return (clean.has_filename() ? clean : clean.parent_path()).filename().string();
}

Status write_text(const std::string& path, const std::string& text) {
  if (path != "-") return write_file(path, text);
  std::fwrite(text.data(), 1, text.size(), stdout);
  return {};
}

CLI::Option* take_list(CLI::Option* option) {
  return option->delimiter(',')->allow_extra_args(false);
}

Status check_one_stdout(std::initializer_list<std::pair<const char*, std::string>> files) {
  const char* first = nullptr;
  for (const auto& [option, path] : files) {
    if (path != "-") continue;
    if (first)
      return invalid_argument(std::string(first) + " - and " + option +
                              " - both write to stdout; name a file for one of them");
    first = option;
  }
  return {};
}

std::vector<std::vector<std::string>> group_inputs(std::span<const std::string> paths) {
  std::vector<std::vector<std::string>> groups;
  std::optional<std::size_t> meshes;
  for (const std::string& path : paths) {
    const bool mesh = is_mesh_file_name(path) || is_point_cache_name(path);
    if (mesh && meshes) {
      groups[*meshes].push_back(path);
      continue;
    }
    if (mesh) meshes = groups.size();
    groups.push_back({path});
  }
  return groups;
}

Status check_paths(std::span<const std::string> paths, std::span<const std::string> words) {
  for (const std::string& path : paths) {
    std::error_code ignored;
    if (path.starts_with("builtin:") || std::filesystem::exists(path, ignored)) continue;
    const bool word = std::ranges::find(words, path) != words.end();
    return invalid_argument(path + ": no such file or folder" +
                            (word ? "; a list is given with commas, as in one,two" : ""));
  }
  return {};
}

}  // namespace warmfront::client
