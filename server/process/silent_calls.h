// SPDX-License-Identifier: Apache-2.0
// The calls of a connection that have not sent one whole message (gRPC over HTTP/2: a byte, four of the
// length, so many bytes). gRPC keeps each of them for as long as its client likes. Used by one thread at a
// time; needs memory only for calls that are silent at once, and keeps it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

namespace warmfront::server {

class SilentCalls {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// A call may be silent for `allowed`. Twice `most` calls are told apart, and the oldest of more than
  /// `most` have had their time: some of them were ended by the server, of which nobody tells.
  SilentCalls(std::size_t most, std::chrono::milliseconds allowed) : most_(most), allowed_(allowed) {}

  bool empty() const { return count_ == 0; }

  /// A call begins, of a larger number than those before. False when there are too many, or no memory.
  [[nodiscard]] bool begin(std::uint32_t stream);
  /// Its client has ended it, or will send no more.
  void end(std::uint32_t stream);
  /// Those that began since the last time began now.
  void note_time(Time now);

  /// DATA of this call begins: true when it is silent so far, and read() wants to know what it holds.
  bool begin_data(std::uint32_t stream);
  /// More of that DATA. False once the message is whole: the call is silent no more.
  bool read(std::span<const std::uint8_t> bytes);

  /// How many have had their time.
  std::size_t overdue(Time now) const;
  /// Whether the oldest has had its time twice.
  bool long_overdue(Time now) const { return count_ > 0 && now - calls_[0].began > 2 * allowed_; }
  /// Takes the oldest one out.
  std::uint32_t take_oldest();

 private:
  struct Call {
    std::uint32_t stream = 0;
    std::uint32_t left = 0;         ///< of the message
    std::uint8_t prefix_bytes = 0;  ///< that came
    bool timed = false;
    Time began{};
  };
  Call* find(std::uint32_t stream);
  void erase(std::size_t index);
  bool grow();

  // Constant after construction.
  std::size_t most_;
  std::chrono::milliseconds allowed_;

  // By number, which is by age. Those not timed yet are the last ones.
  std::unique_ptr<Call[]> calls_;
  std::size_t count_ = 0, room_ = 0;
  std::size_t reading_ = 0;  ///< the one whose DATA came last
};

}  // namespace warmfront::server
