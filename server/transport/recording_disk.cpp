// SPDX-License-Identifier: Apache-2.0
// One queue, one thread. Thread safety as stated in the header.
#include "server/transport/recording_disk.h"

#include <algorithm>
#include <new>
#include <optional>
#include <utility>

#include "server/transport/reaction.h"
#include "server/version.h"

namespace warmfront::server {
namespace {

using std::chrono::steady_clock;

/// Kept back for the marker at the end of each recording, which must fit whatever happened before.
constexpr std::uint64_t kMarkerBytes = 512;
/// Of the queue, for a file from its opening to its closing, and for what is around a record: so the queue is
/// bounded in length, too.
constexpr std::size_t kFileBytes = 1024;
constexpr std::size_t kOrderBytes = 128;

constexpr const char* kSlow =
    "the disk is slower than the sessions; record fewer, use a faster disk, or raise --record-queue-bytes";
constexpr const char* kSessionFull =
    "what waits for the disk, which is slower than the session, would exceed what the session may hold";

}  // namespace

struct RecordingDisk::State {
  State(RecordingOptions the_options, std::uint64_t max_bytes, std::uint64_t held, Log& the_log)
      : options(std::move(the_options)), on_disk(max_bytes), queue_room(options.queue_bytes), log(&the_log) {
    on_disk.take(held);
  }

  /// Nothing is written to the log after ~RecordingDisk().
  void tell(LogLevel level, const char* event, std::initializer_list<LogField> fields) {
    const MutexLock lock(log_mutex);
    if (log != nullptr) log->write(level, event, fields);
  }
  /// Says once for each file why it stopped.
  void tell_stopped(File& file, const std::string& reason) {
    if (file.stopped_.exchange(true, std::memory_order_relaxed)) return;
    tell(LogLevel::kWarning, "recording_stopped", {{"file", file.path_}, {"reason", reason}});
  }
  void tell_refused(const File& file, const std::string& reason) {
    tell(LogLevel::kWarning, "recording_refused", {{"session", file.session_}, {"reason", reason}});
  }

  void post(File::Orders& one) noexcept {
    {
      const MutexLock lock(mutex);
      queue.splice(queue.end(), one);
    }
    changed.notify_one();
  }
  /// Of an order of this file: it waits no longer.
  void release(File& file, std::size_t bytes) noexcept {
    queue_room.give(bytes);
    const MutexLock lock(mutex);
    file.waiting_bytes_ -= bytes;
    file.waiting_.set(file.waiting_bytes_);
  }

  void work() {
    for (;;) {
      File::Orders one;
      {
        UniqueLock lock(mutex);
        while (queue.empty() && !closing) changed.wait(lock);
        if (queue.empty()) {
          ended = true;
          break;
        }
        one.splice(one.begin(), queue, queue.begin());
      }
      carry_out(one.front());
      release(*one.front().file, one.front().bytes);
    }
    changed.notify_all();
  }

  void carry_out(File::Order& order) noexcept {
    File& file = *order.file;
    switch (order.what) {
      case File::Order::What::kOpen:
        return open(order.file);
      case File::Order::What::kAppend:
        // Of one that was stopped for want of room, what was queued before is written still.
        if_memory_allows([&] {
          if (file.writer_) file.writer_->append(order.record);
        });
        return;
      case File::Order::What::kStop:
        if_memory_allows([&] {
          if (file.writer_) file.writer_->stop(order.reason);
        });
        return;
      case File::Order::What::kDiscard:
        if_memory_allows([&] {
          if (file.writer_) file.writer_->discard();
        });
        [[fallthrough]];
      case File::Order::What::kClose:
        file.writer_.reset();
        return;
    }
  }

  void open(const std::shared_ptr<File>& file) {
    std::string refused = "out of memory";  // short enough to need none
    if_memory_allows([&] {
      auto writer = recording::Writer::create(
          file->path_, std::string("warmfrontd ") + kVersion,
          {.admit = [this](std::size_t bytes) { return on_disk.try_take(bytes); },
           .give_back = [this](std::size_t bytes) { on_disk.give(kMarkerBytes + bytes); },
           .stopped = [this, to = file.get()](const std::string& reason) { tell_stopped(*to, reason); },
           .began = file->began_,
           .put = options.put});
      if (writer)
        file->writer_ = std::move(writer).value();
      else
        refused = writer.error().message;
    });
    if (!file->writer_) {
      file->stopped_ = true;
      on_disk.give(kMarkerBytes);
    }
    if_memory_allows([&] {
      if (file->writer_)
        tell(LogLevel::kInfo, "recording", {{"session", file->session_}, {"file", file->path_}});
      else
        tell_refused(*file, refused);
    });
  }

  const RecordingOptions options;

  // Thread-safe.
  Budget on_disk;     // of the folder
  Budget queue_room;  // of what waits

  Mutex log_mutex;
  Log* log WARMFRONT_GUARDED_BY(log_mutex);  // null from the end on

  Mutex mutex;
  std::condition_variable changed;
  File::Orders queue WARMFRONT_GUARDED_BY(mutex);
  std::optional<steady_clock::time_point> deadline WARMFRONT_GUARDED_BY(mutex);
  bool closing WARMFRONT_GUARDED_BY(mutex) = false;  // the thread ends with the queue
  bool ended WARMFRONT_GUARDED_BY(mutex) = false;
};

RecordingDisk::RecordingDisk(RecordingOptions options, std::uint64_t max_bytes, std::uint64_t held, Log& log)
    : state_(std::make_shared<State>(std::move(options), max_bytes, held, log)),
      thread_([state = state_] { state->work(); }) {}

RecordingDisk::~RecordingDisk() {
  State& state = *state_;
  std::size_t left = 0;
  {
    UniqueLock lock(state.mutex);
    state.closing = true;
    state.changed.notify_all();
    const auto deadline = state.deadline.value_or(steady_clock::now() + state.options.flush_timeout);
    while (!state.ended && state.changed.wait_until(lock, deadline) != std::cv_status::timeout) {
    }
    if (!state.ended) left = state.queue.size() + 1;
  }
  if (left == 0) {
    thread_.join();
    return;
  }
  // It goes on for as long as the process does: to close a file that hangs would hang, too.
  thread_.detach();
  const MutexLock lock(state.log_mutex);
  Log* const log = std::exchange(state.log, nullptr);
  if_memory_allows([log, left] {
    log->write(LogLevel::kError, "recordings_cut_off",
               {{"left", std::uint64_t{left}},
                {"reason", "the disk did not take in time what waited for it; these files have no end"}});
  });
}

std::shared_ptr<RecordingDisk::File> RecordingDisk::open(std::string path, std::string session,
                                                         std::shared_ptr<Account> account) {
  State& state = *state_;
  auto file = std::make_shared<File>(std::move(path), std::move(session));
  using What = File::Order::What;
  File::Orders to_open;
  to_open.push_back({What::kOpen, file});
  file->to_stop_.push_back({What::kStop, nullptr});
  file->to_close_.push_back({What::kClose, nullptr});
  if (!state.on_disk.try_take(kMarkerBytes)) {
    state.tell_refused(*file,
                       "the folder holds --record-max-bytes; remove recordings and restart, or raise it");
    return nullptr;
  }
  if (!state.queue_room.try_take(kFileBytes)) {
    state.on_disk.give(kMarkerBytes);
    state.tell_refused(*file, kSlow);
    return nullptr;
  }
  {
    const MutexLock lock(state.mutex);
    file->waiting_ = Holding(std::move(account), kFileBytes);
    file->waiting_bytes_ = kFileBytes;
  }
  state.post(to_open);
  return file;
}

void RecordingDisk::append(const std::shared_ptr<File>& file, std::string record) {
  if (file->stopped()) return;
  File::Orders one;
  one.push_back({File::Order::What::kAppend, file, std::move(record)});
  const std::size_t bytes = kOrderBytes + one.front().record.capacity();
  if (!state_->queue_room.try_take(bytes)) return stop(file, kSlow);
  one.front().bytes = bytes;
  bool fits = true;
  {
    const MutexLock lock(state_->mutex);
    // As much stays free as waits, so that the session is not the one that is refused next. A disk that keeps
    // up is never the reason: with nothing before it, a record may wait however full the session is.
    const Account* const account = file->waiting_.account();
    fits = account == nullptr || file->waiting_bytes_ <= kFileBytes ||
           !account->over(file->waiting_bytes_ + 2 * bytes);
    if (fits) {
      file->waiting_bytes_ += bytes;
      file->waiting_.set(file->waiting_bytes_);
    }
  }
  if (fits) return state_->post(one);
  state_->queue_room.give(bytes);
  stop(file, kSessionFull);
}

void RecordingDisk::stop(const std::shared_ptr<File>& file, const char* reason) noexcept {
  if (file->to_stop_.empty()) return;
  if_memory_allows([&] { state_->tell_stopped(*file, reason); });
  file->stopped_ = true;
  file->to_stop_.front().file = file;
  file->to_stop_.front().reason = reason;
  state_->post(file->to_stop_);
}

void RecordingDisk::close(const std::shared_ptr<File>& file, bool keep) noexcept {
  {
    // The session is gone: what its file waits for must not keep its account, and so what it had reserved.
    const MutexLock lock(state_->mutex);
    file->waiting_ = Holding();
  }
  File::Order& order = file->to_close_.front();
  order.file = file;
  order.what = keep ? File::Order::What::kClose : File::Order::What::kDiscard;
  order.bytes = kFileBytes;
  state_->post(file->to_close_);
}

void RecordingDisk::finish_by(steady_clock::time_point deadline) {
  const MutexLock lock(state_->mutex);
  state_->deadline = deadline;
}

std::size_t RecordingDisk::queued_bytes() const {
  return state_->queue_room.used();
}

}  // namespace warmfront::server
