// SPDX-License-Identifier: Apache-2.0
// The rule of frame numbers: one answer to each, in order. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <string>

namespace warmfront::server {

/// As messages call it.
inline std::string frame_name(std::uint64_t frame) {
  return "frame " + std::to_string(frame);
}

class FrameSequence {
 public:
  enum class Verdict {
    kNext,        ///< compute it
    kRepeat,      ///< the last one that was answered, again
    kOutOfOrder,  ///< a gap, or backwards
  };

  /// `first` is the number of the positions that the session was created with.
  explicit FrameSequence(std::uint64_t first) : first_(first), last_(first) {}

  Verdict classify(std::uint64_t frame) const {
    if (frame == last_ + 1) return Verdict::kNext;
    // The first frame had no answer, so there is nothing to repeat.
    return frame == last_ && last_ != first_ ? Verdict::kRepeat : Verdict::kOutOfOrder;
  }
  /// The expected frame was answered.
  void advance() { ++last_; }

  std::uint64_t last() const { return last_; }
  std::uint64_t expected() const { return last_ + 1; }
  std::uint64_t steps() const { return last_ - first_; }

 private:
  std::uint64_t first_;
  std::uint64_t last_;
};

}  // namespace warmfront::server
