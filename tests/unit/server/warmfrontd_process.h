// SPDX-License-Identifier: Apache-2.0
// warmfrontd as a process of its own.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace warmfront::test {

/// A warmfrontd on a Unix socket; killed at the end if it still runs.
class Process {
 public:
  explicit Process(const std::filesystem::path& folder, std::vector<std::string> more = {})
      : folder_(folder), more_(std::move(more)) {
    start();
  }
  ~Process() {
    if (pid_ > 0) kill_hard();
  }

  std::string address() const { return "unix:" + (folder_ / "d.sock").string(); }
  std::string log() const {
    std::stringstream text;
    text << std::ifstream(folder_ / "log").rdbuf();
    return text.str();
  }

  void start() {
    const std::string listen = address();
    const std::string log = folder_ / "log";
    std::vector<const char*> arguments{WARMFRONTD,  "--listen", listen.c_str(), "--log-format", "json",
                                       "--threads", "2"};
    for (const std::string& argument : more_) arguments.push_back(argument.c_str());
    if (std::ranges::find(more_, "--drain-timeout") == more_.end())
      arguments.insert(arguments.end(), {"--drain-timeout", "20s"});
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 2, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    ASSERT_EQ(
        posix_spawn(&pid_, WARMFRONTD, &actions, nullptr, const_cast<char**>(arguments.data()), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
  }
  void terminate() { kill(pid_, SIGTERM); }
  void reload() { kill(pid_, SIGHUP); }
  void kill_hard() {
    kill(pid_, SIGKILL);
    wait();
  }
  /// The exit status as waitpid() gives it; nothing while the process runs.
  std::optional<int> ended() {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
    pid_ = -1;
    return status;
  }
  /// The exit status as waitpid() gives it; -1 when the process does not end in time.
  int wait() {
    int status = 0;
    for (int i = 0; i < 3000; ++i) {
      const pid_t ended = waitpid(pid_, &status, WNOHANG);
      if (ended == pid_) {
        pid_ = -1;
        return status;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return -1;
  }

 private:
  const std::filesystem::path folder_;
  const std::vector<std::string> more_;
  pid_t pid_ = -1;
};

}  // namespace warmfront::test
