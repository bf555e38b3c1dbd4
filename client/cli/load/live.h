// SPDX-License-Identifier: Apache-2.0
// Live status of a load on stderr: one line, redrawn every second on a terminal, a plain line every five
// seconds elsewhere. Used by one thread at a time.
#pragma once

#include <string>

#include "client/cli/load/measured.h"

namespace warmfront::client::load {

class Live {
 public:
  explicit Live(const Plan& plan);
  /// Erases the line.
  ~Live();
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;

  void show(const Second& second);

 private:
  const Plan& plan_;
  const bool terminal_;
  bool shown_ = false;
  double last_ = 0;
  std::uint64_t errors_ = 0;
};

}  // namespace warmfront::client::load
