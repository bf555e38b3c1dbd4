// SPDX-License-Identifier: Apache-2.0
// Steps of an input: see frame_steps.h.
#include "client/cli/frames/frame_steps.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <utility>

namespace warmfront::client {
namespace {

bool parse_frame(std::string_view text, std::uint32_t& index) {
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), index);
  return code == std::errc() && end == text.data() + text.size();
}

/// from + (to - from) * share, in double.
PositionBuffer interpolate(const PositionBuffer& from, const PositionBuffer& to, double share) {
  const Positions p0 = view(from);
  const Positions p1 = view(to);
  std::vector<double> mixed(3 * vertex_count(from));
  for (std::size_t i = 0; i < mixed.size(); ++i) {
    const double x0 = coordinate(p0, i);
    mixed[i] = x0 + (coordinate(p1, i) - x0) * share;
  }
  return mixed;
}

}  // namespace

Result<FrameRange> parse_frame_range(std::string_view text, std::uint32_t frame_count,
                                     std::size_t least_frames) {
  FrameRange range{0, frame_count - 1};
  const std::size_t colon = text.find(':');
  const std::string_view first = text.substr(0, colon);
  const std::string_view last = colon == std::string_view::npos ? std::string_view() : text.substr(colon + 1);
  const bool readable = colon != std::string_view::npos &&
                        (first.empty() || parse_frame(first, range.first)) &&
                        (last.empty() || parse_frame(last, range.last));
  if (!readable) return invalid_argument("--frames takes FIRST:LAST, not '" + std::string(text) + "'");
  if (range.last >= frame_count || std::uint64_t{range.first} + least_frames > std::uint64_t{range.last} + 1)
    return invalid_argument("--frames " + std::string(text) + ": FIRST must be " +
                            (least_frames > 1 ? "below LAST" : "LAST or less") + ", and LAST at most " +
                            std::to_string(frame_count - 1));
  return range;
}

std::vector<PartRange> parts_in(Input& first, FrameRange range) {
  std::vector<PartRange> parts;
  for (Input* part = &first; part != nullptr; part = part->next()) {
    const std::uint32_t begin = std::max(range.first, part->first_number());
    const std::uint32_t end = std::min(range.last, part->first_number() + part->frame_count() - 1);
    const bool one_mesh = part->frame_count() == 1 && begin == end;
    if (begin < end || one_mesh)
      parts.push_back({part, {begin - part->first_number(), end - part->first_number()}});
  }
  return parts;
}

Result<FrameSteps> FrameSteps::open(Input& input, FrameRange range, std::uint32_t substeps) {
  FrameSteps steps(input, range, substeps);
  if (const Status status = input.read_frame(range.first, steps.end_); !status) return status.error();
  steps.start_ = steps.end_;
  steps.to_frame_ = steps.end_;
  return steps;
}

Status FrameSteps::next() {
  const std::uint64_t part = done_ % substeps_;
  const auto frame = static_cast<std::uint32_t>(range_.first + done_ / substeps_ + 1);
  std::swap(start_, end_);
  if (substeps_ == 1) {
    if (const Status status = input_->read_frame(frame, end_); !status) return status;
  } else {
    if (part == 0) {
      std::swap(from_frame_, to_frame_);
      if (const Status status = input_->read_frame(frame, to_frame_); !status) return status;
    }
    end_ = part + 1 == substeps_
               ? to_frame_
               : interpolate(from_frame_, to_frame_, static_cast<double>(part + 1) / substeps_);
  }
  ++done_;
  return {};
}

}  // namespace warmfront::client
