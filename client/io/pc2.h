// SPDX-License-Identifier: Apache-2.0
// PC2 (Point Cache 2): the positions of a mesh, frame by frame. Frames are read and written one at a time; a
// reader or writer is used by one thread at a time.
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

/// The 32 bytes at the start of a cache, little-endian: "POINTCACHE2\0", version 1, points, start frame,
/// sample rate (frames a sample), samples.
struct Pc2Header {
  static constexpr std::size_t kBytes = 32;
  std::uint32_t point_count = 0;
  float start_frame = 0;
  float sample_rate = 1;
  std::uint32_t sample_count = 0;
};

/// Reads the header at the start of `bytes`; `file` names the source in errors, which say the byte.
Result<Pc2Header> parse_pc2_header(std::string_view bytes, std::string_view file);

class Pc2Reader {
 public:
  /// Opens a cache and checks that the file is as long as its header says (or longer).
  static Result<Pc2Reader> open(const std::string& path);

  const Pc2Header& header() const { return header_; }

  /// Reads sample `index` into `positions`, (n, 3) row-major.
  Status read(std::uint32_t index, std::vector<float>& positions);

 private:
  Pc2Reader(std::string path, std::ifstream file, Pc2Header header)
      : path_(std::move(path)), file_(std::move(file)), header_(header) {}

  std::string path_;
  std::ifstream file_;
  Pc2Header header_;
};

class Pc2Writer {
 public:
  static Result<Pc2Writer> create(const std::string& path, const Pc2Header& header);

  /// Appends a sample of (point_count, 3) positions.
  void append(std::span<const float> positions);

  /// Closes the file; fails on a disk error, or when there are more or fewer samples than the header says.
  Status close();

 private:
  Pc2Writer(OutputFile file, Pc2Header header) : file_(std::move(file)), header_(header) {}

  OutputFile file_;
  Pc2Header header_;
  std::uint64_t values_written_ = 0;
};

}  // namespace warmfront::client
