// SPDX-License-Identifier: Apache-2.0
// Two daemons and an address that leads to either.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>

#include <cstddef>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/faults/daemon_process.h"
#include "tests/faults/switch_proxy.h"

namespace warmfront::test {

/// Two daemons, the second of which allows few contacts in an answer, and an address that leads to one.
class TwoDaemons {
 public:
  static constexpr std::size_t kFewContacts = 12;

  // Sessions that a daemon lost to the other one stay there until they are idle for long.
  TwoDaemons()
      : daemons_{DaemonProcess({"--max-sessions", "1000000"}),
                 DaemonProcess({"--max-sessions", "1000000", "--max-contacts", "12"})} {
    for (DaemonProcess& daemon : daemons_) EXPECT_GE(daemon.port(), 0) << daemon.log();
  }
  ~TwoDaemons() { thaw(); }

  std::string address() const { return proxy_.address(); }
  std::string address_in_use() const { return daemons_[in_use_].socket(); }
  bool frozen_in_use() const { return frozen_[in_use_]; }

  void cut() { proxy_.lead_to(in_use_); }
  void go_to_the_other() {
    in_use_ = 1 - in_use_;
    thaw(in_use_);
    proxy_.lead_to(in_use_);
  }
  void kill_in_use() {
    daemons_[in_use_].kill_hard();
    daemons_[in_use_].start();
  }
  void freeze_in_use() {
    const std::size_t frozen = in_use_;
    kill(daemons_[frozen].pid(), SIGSTOP);
    frozen_[frozen] = true;
    go_to_the_other();
  }
  void thaw() {
    thaw(0);
    thaw(1);
  }
  /// Whether clients are offered memory to share with the daemon in use.
  void share_memory(bool shared) {
    offers_memory_ = shared;
    proxy_.share_memory(shared);
  }
  bool offers_memory() const { return offers_memory_; }
  /// Does the daemon in use share memory with anybody?
  bool shares_memory() const {
    std::stringstream maps;
    maps << std::ifstream("/proc/" + std::to_string(daemons_[in_use_].pid()) + "/maps").rdbuf();
    return maps.str().find("/memfd:") != std::string::npos;
  }
  void lose_answers() { proxy_.lose_answers(); }

 private:
  void thaw(std::size_t daemon) {
    if (!frozen_[daemon]) return;
    kill(daemons_[daemon].pid(), SIGCONT);
    frozen_[daemon] = false;
  }

  DaemonProcess daemons_[2];
  bool frozen_[2] = {false, false};
  std::size_t in_use_ = 0;
  bool offers_memory_ = false;
  SwitchProxy proxy_{{daemons_[0].socket().substr(5), daemons_[1].socket().substr(5)}};
};

}  // namespace warmfront::test
