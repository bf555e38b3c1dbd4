// SPDX-License-Identifier: Apache-2.0
// What verbs share: see verb.h.
#include "client/cli/verb.h"

#include <cstdio>
#include <filesystem>

#include "client/cli/exit_codes.h"
#include "client/io/file.h"

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

int finish_output() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout)) return failure("cannot write to stdout");
  return kExitOk;
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

}  // namespace warmfront::client
