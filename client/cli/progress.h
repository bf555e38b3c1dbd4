// SPDX-License-Identifier: Apache-2.0
// How far a verb is, on stderr: a bar on a terminal, now and then a plain line elsewhere. One thread at a
// time.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace warmfront::client {

/// Whether stderr is a terminal that lines can be drawn on anew.
bool is_capable_terminal();

class Progress {
 public:
  /// `what` is counted, e.g. "frame"; `total` of them.
  Progress(std::string what, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` of the total are done. Cheap: shows something only every so often.
  void update(std::uint64_t done);

  /// Takes the bar away, so that something else may be printed on the terminal.
  void clear();

 private:
  void draw(std::uint64_t done);

  std::string what_;
  std::uint64_t total_;
  bool terminal_;
  bool colour_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace warmfront::client
