// SPDX-License-Identifier: Apache-2.0
// The steps of an input: a range of frames, each step split in equal parts if asked. One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "client/io/input.h"
#include "engine/result.h"

namespace warmfront::client {

/// Frames first, first + 1, ..., last.
struct FrameRange {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
};

/// Reads "FIRST:LAST", in which either may be left out; both are indices of frames below frame_count, and the
/// range has `least_frames`, 1 or 2, or more.
Result<FrameRange> parse_frame_range(std::string_view text, std::uint32_t frame_count,
                                     std::size_t least_frames = 2);

/// A part of an input, and which of its own frames are stepped through.
struct PartRange {
  Input* input;
  FrameRange range;
};
/// The parts with steps in `range`, which counts the frames of all parts and has a step at least; and those
/// within it that are one mesh, which is looked at though nothing moves.
std::vector<PartRange> parts_in(Input& first, FrameRange range);

class FrameSteps {
 public:
  /// Reads the first frame. `range` is of the input's own frames, and `substeps` >= 1.
  static Result<FrameSteps> open(Input& input, FrameRange range, std::uint32_t substeps);

  std::uint64_t step_count() const { return std::uint64_t{range_.last - range_.first} * substeps_; }

  /// Where the current step starts (before the first next(): frame `first`) and ends.
  Positions start() const { return view(start_); }
  Positions end() const { return view(end_); }
  /// The current step's number: that of its end frame in the whole input; with substeps, counted in substeps
  /// from frame 0.
  std::uint64_t number() const {
    return std::uint64_t{input_->first_number() + range_.first} * substeps_ + done_;
  }

  /// Moves to the next of step_count() steps. Between frames positions are interpolated linearly in double
  /// precision, so that the K-th of K substeps ends in the frame's own positions.
  Status next();

 private:
  FrameSteps(Input& input, FrameRange range, std::uint32_t substeps)
      : input_(&input), range_(range), substeps_(substeps) {}

  Input* input_;
  FrameRange range_;
  std::uint32_t substeps_;
  std::uint64_t done_ = 0;
  PositionBuffer from_frame_, to_frame_;  ///< the frames on both sides, when there are substeps
  PositionBuffer start_, end_;
};

}  // namespace warmfront::client
