// SPDX-License-Identifier: Apache-2.0
// Progress: see progress.h.
#include "client/cli/progress.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace warmfront::client {
namespace {

constexpr auto kBarInterval = std::chrono::milliseconds(100);
constexpr auto kLineInterval = std::chrono::seconds(5);
constexpr std::uint64_t kBarWidth = 30;

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

}  // namespace

bool is_capable_terminal() {
  const char* term = std::getenv("TERM");
  return isatty(STDERR_FILENO) != 0 && term != nullptr && std::string_view(term) != "dumb";
}

Progress::Progress(std::string what, std::uint64_t total)
    : what_(std::move(what)),
      total_(total),
      terminal_(is_capable_terminal()),
      colour_(terminal_ && !is_set("NO_COLOR")),
      last_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  clear();
}

void Progress::update(std::uint64_t done) {
  const auto now = std::chrono::steady_clock::now();
  if (terminal_ ? now - last_ < kBarInterval : now - last_ < kLineInterval) return;
  last_ = now;
  if (terminal_)
    draw(done);
  else
    std::fprintf(stderr, "%s %llu of %llu\n", what_.c_str(), static_cast<unsigned long long>(done),
                 static_cast<unsigned long long>(total_));
}

void Progress::clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

void Progress::draw(std::uint64_t done) {
  const std::uint64_t filled = total_ == 0 ? kBarWidth : kBarWidth * done / total_;
  std::string bar(filled, '#');
  bar.append(kBarWidth - filled, '.');
  std::fprintf(stderr, "\r%s[%s]%s %s %llu of %llu\033[K", colour_ ? "\033[36m" : "", bar.c_str(),
               colour_ ? "\033[0m" : "", what_.c_str(), static_cast<unsigned long long>(done),
               static_cast<unsigned long long>(total_));
  std::fflush(stderr);
  shown_ = true;
}

}  // namespace warmfront::client
