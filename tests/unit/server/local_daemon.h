// SPDX-License-Identifier: Apache-2.0
// A daemon for tests: in this process, on a Unix socket in its own folder. Used by one thread at a time.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <sstream>
#include <string>

#include "server/daemon.h"

namespace warmfront::test {

/// A folder that is removed with everything in it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "warmfront_XXXXXX").string();
    if (mkdtemp(pattern.data()) != nullptr) path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

class LocalDaemon {
 public:
  explicit LocalDaemon(server::Config config = {}) : config_(std::move(config)) {
    config_.listen = {address()};
    config_.threads = 2;
    start();
  }

  std::string address() const { return "unix:" + (folder_.path() / "d.sock").string(); }
  server::Daemon& operator*() { return *daemon_; }
  server::Daemon* operator->() { return daemon_.get(); }
  std::string log() const { return log_text_.str(); }

  /// All sessions are lost, as in a crash. `change` may modify its options.
  void restart(const std::function<void(server::Config&)>& change = {}) {
    daemon_.reset();
    if (change) change(config_);
    start();
  }
  void stop() { daemon_.reset(); }
  void start() {
    auto started = server::Daemon::start(config_, log_);
    ASSERT_TRUE(started.ok()) << started.error().message;
    daemon_ = std::move(started).value();
  }

 private:
  const TemporaryFolder folder_;
  server::Config config_;
  std::ostringstream log_text_;
  server::Log log_{server::LogLevel::kDebug, server::LogFormat::kJson, &log_text_};
  std::unique_ptr<server::Daemon> daemon_;
};

}  // namespace warmfront::test
