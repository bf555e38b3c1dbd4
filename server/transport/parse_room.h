// SPDX-License-Identifier: Apache-2.0
// The memory that messages take while they are parsed and read: bounded for each, and for all at once.
// Thread-safe.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <condition_variable>
#include <cstddef>
#include <utility>

#include "server/annotations.h"
#include "server/fault.h"
#include "server/transport/parsed_size.h"

namespace warmfront::server {

/// A message takes its place before it is parsed, and gives it back when what it became is gone. Only who
/// parses and handles a message holds a place, on a thread, and none holds two: who waits for one waits for
/// work that goes on.
class ParseRoom {
 public:
  /// Honest messages are made of strings, which become no more than they were, and of lists of bodies, which
  /// become eight times as much where bodies have no names: 2.6 million such bodies pass by default.
  static constexpr std::size_t kTimesMessage = 8;
  explicit ParseRoom(std::size_t max_message_bytes) : limit_(kTimesMessage * max_message_bytes + (1 << 20)) {}

  class Place {
   public:
    Place() = default;
    Place(Place&& other) noexcept
        : room_(std::exchange(other.room_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Place& operator=(Place&& other) noexcept {
      std::swap(room_, other.room_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Place() {
      if (room_ != nullptr) room_->leave(bytes_);
    }

   private:
    friend class ParseRoom;
    Place(ParseRoom& room, std::size_t bytes) : room_(&room), bytes_(bytes) {}
    ParseRoom* room_ = nullptr;
    std::size_t bytes_ = 0;
  };

  /// RESOURCE_EXHAUSTED for a message that would become more than the limit, and, with a time to try again
  /// after, for one that waited for two seconds for others to be done. `method` names it.
  Outcome<Place> enter(const grpc::ByteBuffer& message, const MessageLayout& type, const char* method);

  std::size_t limit() const { return limit_; }
  std::size_t used() const;

 private:
  void leave(std::size_t bytes);

  const std::size_t limit_;

  // Protected by mutex_.
  mutable Mutex mutex_;
  std::condition_variable left_;
  std::size_t used_ WARMFRONT_GUARDED_BY(mutex_) = 0;
};

/// A message, and its place.
template <class Message>
struct Parsed {
  ParseRoom::Place place;
  Message message;
};

}  // namespace warmfront::server
