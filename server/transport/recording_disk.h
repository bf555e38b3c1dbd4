// SPDX-License-Identifier: Apache-2.0
// The thread that opens, writes and closes the files of all recordings, so that no session, call or timer
// waits for a disk. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <thread>

#include "proto/recording/writer.h"
#include "server/annotations.h"
#include "server/log.h"
#include "server/session/account.h"

namespace warmfront::server {

struct RecordingOptions {
  /// That wait for the disk, of all recordings together.
  std::size_t queue_bytes = std::size_t{64} << 20;
  /// How long the end waits for what is queued, unless RecordingDisk::finish_by() says otherwise.
  std::chrono::milliseconds flush_timeout = std::chrono::seconds(30);
  /// See recording::WriterOptions.
  std::function<ssize_t(int file, const char* bytes, std::size_t count)> put = {};
};

/// What is done to a file is done in the order in which it was asked for. Nothing here fails or waits: where
/// the queue has no room for a record, its recording stops, with a line in the log and the marker behind the
/// records that were queued before.
class RecordingDisk {
 public:
  class File;

  /// Files may hold `max_bytes` in all, of which `held` are there already. `log` outlives this.
  RecordingDisk(RecordingOptions options, std::uint64_t max_bytes, std::uint64_t held, Log& log);
  /// Waits for what is queued, until the deadline at most. What is not written by then is left out, with a
  /// line in the log: readers take such files for ones that were cut off. Every file was closed before.
  ~RecordingDisk();
  RecordingDisk(const RecordingDisk&) = delete;
  RecordingDisk& operator=(const RecordingDisk&) = delete;

  /// Creates the file `path` soon. Null, with a line in the log, where there is no room for another. What of
  /// it waits for the disk is charged to `account`, which may be null, until the file is closed.
  std::shared_ptr<File> open(std::string path, std::string session, std::shared_ptr<Account> account);
  /// Appends what recording::record_of() made. Like stop() and close() called by one thread at a time for
  /// each file.
  void append(const std::shared_ptr<File>& file, std::string record);
  /// Stops the recording behind what is queued; `reason` lives for ever.
  void stop(const std::shared_ptr<File>& file, const char* reason) noexcept;
  /// Ends the recording as complete unless it stopped, or removes the file where there is nothing to keep.
  /// Exactly once for each file, and the last of its calls.
  void close(const std::shared_ptr<File>& file, bool keep) noexcept;

  /// The end waits until then and not longer.
  void finish_by(std::chrono::steady_clock::time_point deadline);
  /// Bytes that wait for the disk, with what is around them.
  std::size_t queued_bytes() const;

 private:
  struct State;
  const std::shared_ptr<State> state_;  // the thread's too, which a disk that hangs keeps beyond this
  std::thread thread_;
};

/// A recording's file, as it is handed back and forth.
class RecordingDisk::File {
 public:
  File(std::string path, std::string session) : path_(std::move(path)), session_(std::move(session)) {}
  /// Whether it was stopped: what is appended is left out.
  bool stopped() const { return stopped_.load(std::memory_order_relaxed); }

 private:
  friend class RecordingDisk;
  struct Order {
    enum class What : std::uint8_t { kOpen, kAppend, kStop, kClose, kDiscard } what;
    std::shared_ptr<File> file = {};
    std::string record = {};
    const char* reason = "";
    std::size_t bytes = 0;  // of the queue
  };
  using Orders = std::list<Order>;

  // Constant after construction.
  const std::string path_;
  const std::string session_;
  const std::chrono::system_clock::time_point began_ = std::chrono::system_clock::now();

  std::atomic<bool> stopped_{false};
  // Used by who records: nodes, so that to stop and to close need no memory.
  Orders to_stop_, to_close_;
  // Used by the disk's thread only.
  std::unique_ptr<recording::Writer> writer_;
  // Protected by the state's mutex.
  Holding waiting_;
  std::size_t waiting_bytes_ = 0;
};

}  // namespace warmfront::server
