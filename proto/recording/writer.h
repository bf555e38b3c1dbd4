// SPDX-License-Identifier: Apache-2.0
// Writes a recording, record by record, so that a killed process leaves all but the last. Used by one thread
// at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "engine/result.h"
#include "warmfront/v1/recording.pb.h"

namespace warmfront::recording {

struct WriterOptions {
  /// Asked before so many bytes are written; a false stops the recording. Empty: no bound.
  std::function<bool(std::size_t)> admit = {};
  /// Told of what was admitted when the recording is discarded.
  std::function<void(std::size_t)> give_back = {};
  /// Told once, when the recording stops before its end.
  std::function<void(const std::string& reason)> stopped = {};
};

class Writer {
 public:
  /// Creates `path`, which must not exist, for its owner alone (mode 0600), and writes the header; `program`
  /// as in RecordingHeader.
  static Result<std::unique_ptr<Writer>> create(const std::string& path, const std::string& program,
                                                WriterOptions options = {});
  /// Marks the recording as complete, unless it stopped.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Never fails: what cannot be written stops the recording, with a marker behind its last whole record.
  void write(v1::RecordedMessage message);
  /// Why it stopped; empty while it goes on.
  const std::string& stop_reason() const { return stopped_; }
  /// Stops it, as what cannot be written does.
  void stop(const std::string& reason);
  /// Removes the file: there is nothing to keep.
  void discard();

 private:
  Writer(int file, std::string path, WriterOptions options);
  bool put(const std::string& bytes);
  void put_end(bool complete, const std::string& reason);

  const int file_;
  const std::string path_;
  const WriterOptions options_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::uint64_t written_ = 0;  // bytes of whole records
  std::size_t admitted_ = 0;
  std::string stopped_;
};

}  // namespace warmfront::recording
