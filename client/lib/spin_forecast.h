// SPDX-License-Identifier: Apache-2.0
// When it pays to wait for an answer without sleeping, by how long the last ones took: to wake up takes as
// long as to copy the positions of 50,000 vertices. A pure value, used by one thread at a time.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace warmfront::client {

class SpinForecast {
 public:
  using Time = std::chrono::duration<double, std::micro>;
  /// After the waiting began.
  struct Window {
    Time begin;
    Time end;
  };

  /// For the next answer. None where they come too irregularly, or came after the last windows, which then
  /// are given more and more rarely.
  std::optional<Window> next();
  /// It came, so long after the waiting began, of which `window` is what next() gave.
  void came(Time after, const std::optional<Window>& window);

 private:
  static constexpr std::size_t kKept = 8;
  std::array<Time, kKept> last_{};  // of count_ that came, a ring
  std::size_t count_ = 0;
  std::uint32_t missed_ = 0;  // windows in a row after whose end an answer came
  std::uint32_t skip_ = 0;    // times more that there is none
};

}  // namespace warmfront::client
