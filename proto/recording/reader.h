// SPDX-License-Identifier: Apache-2.0
// Reads a recording, record by record. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "engine/result.h"
#include "warmfront/v1/recording.pb.h"

namespace warmfront::recording {

class Reader {
 public:
  /// kInvalidArgument for an invalid recording or an unknown version, with the path and the byte.
  static Result<Reader> open(const std::string& path);

  const std::string& path() const { return path_; }
  const v1::RecordingHeader& header() const { return header_; }
  /// The next record; none at the end. kInvalidArgument for a malformed record, with its byte.
  Result<std::optional<v1::RecordedMessage>> next();
  /// At the end: bytes of a truncated last record, which was ignored.
  std::uint64_t torn_bytes() const { return torn_bytes_; }
  /// Offset of the next record.
  std::uint64_t at() const { return at_; }
  /// "PATH: byte N: WHAT".
  Error error(std::uint64_t byte, const std::string& what) const;

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  Reader(std::string path, std::FILE* file, std::uint64_t size)
      : path_(std::move(path)), file_(file), size_(size) {}
  Result<std::optional<v1::RecordedMessage>> torn(std::uint64_t from);

  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t size_;
  std::uint64_t at_ = 0;
  std::uint64_t torn_bytes_ = 0;
  bool ended_ = false;
  v1::RecordingHeader header_;
};

}  // namespace warmfront::recording
