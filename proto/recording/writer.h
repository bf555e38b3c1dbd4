// SPDX-License-Identifier: Apache-2.0
// Writes a recording, record by record, so that a killed process loses at most the last one. Used by one
// thread at a time.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "engine/result.h"
#include "warmfront/v1/recording.pb.h"

namespace warmfront::recording {

struct WriterOptions {
  /// Called before each write with its size in bytes; false stops the recording. Empty: no bound.
  std::function<bool(std::size_t)> admit = {};
  /// Called with the admitted bytes when the recording is discarded.
  std::function<void(std::size_t)> give_back = {};
  /// Called once, when the recording stops before its end.
  std::function<void(const std::string& reason)> stopped = {};
  /// Begin of the recorded session; none: now.
  std::optional<std::chrono::system_clock::time_point> began = std::nullopt;
  /// Replacement for write(2), with errno; empty: write(2). For tests of a disk that hangs.
  std::function<ssize_t(int file, const char* bytes, std::size_t count)> put = {};
};

/// A message as a record, with its length in front, for Writer::append(). kResourceExhausted if it is larger
/// than readers accept.
Result<std::string> record_of(const v1::RecordedMessage& message);

class Writer {
 public:
  /// Creates `path`, which must not exist, readable by its owner only (mode 0600), and writes the header;
  /// `program` as in RecordingHeader.
  static Result<std::unique_ptr<Writer>> create(const std::string& path, const std::string& program,
                                                WriterOptions options = {});
  /// Marks the recording as complete, unless it stopped.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Never fails: a write error stops the recording, with a marker after its last whole record. The message
  /// gets the time since this was created.
  void write(v1::RecordedMessage message);
  /// The same for a record from record_of(), which has its time already.
  void append(const std::string& record);
  /// Why it stopped; empty while it is recording.
  const std::string& stop_reason() const { return stopped_; }
  /// Stops it, as a write error does.
  void stop(const std::string& reason);
  /// Removes the file.
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
