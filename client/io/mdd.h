// SPDX-License-Identifier: Apache-2.0
// MDD (LightWave's point cache): the positions of a mesh, frame by frame. Frames are read and written one at
// a time; a reader or writer is used by one thread at a time.
#pragma once

#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/file.h"
#include "engine/result.h"

namespace warmfront::client {

/// Big-endian: int32 frames, int32 points, then a float32 of seconds for each frame, then (frames, points, 3)
/// float32.
struct MddHeader {
  static constexpr std::size_t kBytes = 8;  ///< without the times
  std::uint32_t frame_count = 0;
  std::uint32_t point_count = 0;
};

/// Reads the header at the start of `bytes`, which are all of a file of `size` bytes or its first; `file`
/// names the source in errors, which say the byte. An MDD has no mark of its own: the file must be as long as
/// its header says, and no longer.
Result<MddHeader> parse_mdd_header(std::string_view bytes, std::uint64_t size, std::string_view file);

class MddReader {
 public:
  static Result<MddReader> open(const std::string& path);

  const MddHeader& header() const { return header_; }

  /// Reads frame `index` into `positions`, (n, 3) row-major.
  Status read(std::uint32_t index, std::vector<float>& positions);

 private:
  MddReader(std::string path, std::ifstream file, MddHeader header)
      : path_(std::move(path)), file_(std::move(file)), header_(header) {}

  std::string path_;
  std::ifstream file_;
  MddHeader header_;
};

class MddWriter {
 public:
  /// Frames are `seconds` apart, the first at 0.
  static Result<MddWriter> create(const std::string& path, const MddHeader& header, double seconds);

  /// Appends a frame of (point_count, 3) positions.
  void append(std::span<const float> positions);

  /// Closes the file; fails on a disk error, or when there are more or fewer frames than the header says.
  Status close();

 private:
  MddWriter(OutputFile file, MddHeader header) : file_(std::move(file)), header_(header) {}

  OutputFile file_;
  MddHeader header_;
  std::uint64_t values_written_ = 0;
};

}  // namespace warmfront::client
