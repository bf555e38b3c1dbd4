// SPDX-License-Identifier: Apache-2.0
// Progress of a verb on stderr: a bar on a terminal, occasional plain lines elsewhere. One thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace warmfront::client {

/// Is stderr a terminal that can redraw lines?
bool is_capable_terminal();

class Progress {
 public:
  /// `what` is the counted unit, e.g. "frame"; `total` of them.
  Progress(std::string what, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` of the total are done. Cheap: redraws only at intervals.
  void update(std::uint64_t done);

  /// Erases the bar, so that other output may be printed.
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
