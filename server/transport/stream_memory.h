// SPDX-License-Identifier: Apache-2.0
// What a stream and its client share: memory, and the tokens by which a client says whose it is. Thread-safe.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/annotations.h"
#include "server/fault.h"
#include "server/process/packet_sockets.h"
#include "server/process/shared_mapping.h"
#include "server/session/account.h"
#include "server/session/answer.h"
#include "server/session/frame_buffer.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// Memory that one stream's client sees too, charged to its session for as long as anyone holds it.
class StreamMemory {
 public:
  /// RESOURCE_EXHAUSTED where the session may not hold so much more, or there is no memory. `all` counts what
  /// all streams share, and outlives this.
  static Outcome<std::shared_ptr<StreamMemory>> create(const std::shared_ptr<Account>& account,
                                                       std::uint64_t bytes, std::atomic<std::uint64_t>& all);
  ~StreamMemory();
  StreamMemory(const StreamMemory&) = delete;
  StreamMemory& operator=(const StreamMemory&) = delete;

  SharedMapping& mapping() { return *mapping_; }

 private:
  StreamMemory(std::shared_ptr<SharedMapping> mapping, Holding holding, std::atomic<std::uint64_t>& all);

  const std::shared_ptr<SharedMapping> mapping_;
  const Holding holding_;
  std::atomic<std::uint64_t>& all_;
};

/// Where a frame's answer may be put; nowhere by default.
struct AnswerRoom {
  std::shared_ptr<StreamMemory> memory;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
};

/// What a frame says of the memory.
struct SharedParts {
  /// Its positions or what moved, where they are: to be copied once, while `room` or the stream holds the
  /// memory.
  std::optional<std::string_view> positions;
  std::optional<MovedPiece> moved;
  AnswerRoom room;
};

/// Takes that out of the frame's message. `others`: the frame has positions, or what moved, from elsewhere.
/// `memory`: the stream's; null where it has none. INVALID_ARGUMENT for what is not within it, and for a
/// message that may not say so: the message is then left as it is.
Outcome<SharedParts> take_shared_parts(v1::StepFrame& step, bool others,
                                       const std::shared_ptr<StreamMemory>& memory);

/// Puts all columns there; false, with nothing written, where they are longer than the room.
bool put_columns(const Answer& answer, const AnswerRoom& room, v1::SharedColumns& columns);

/// A stream that may be bound to a connection.
class SharesMemory : public PacketReader {
 public:
  /// The connection brings the stream's token. False: it ends.
  virtual bool bind(const std::shared_ptr<PacketConnection>& connection,
                    const v1::SharedMemoryRequest& request) = 0;
};

/// Who asks for memory is bound to the stream whose token is given.
class MemoryDesk final : public PacketReader {
 public:
  /// Listens beside the daemon's Unix sockets, whose paths these are. kUnavailable where it cannot.
  static Result<std::unique_ptr<MemoryDesk>> start(const std::vector<std::string>& paths, int threads,
                                                   std::chrono::microseconds spin);
  /// After the last stream has ended.
  ~MemoryDesk() override;

  /// A token for one request, until it is used or withdrawn; empty where the system has no randomness.
  std::string offer(const std::weak_ptr<SharesMemory>& stream);
  void withdraw(const std::string& token) noexcept;

 private:
  MemoryDesk() = default;

  bool packet(const std::shared_ptr<PacketConnection>& from, std::string_view packet) noexcept override;
  void has_room(const std::shared_ptr<PacketConnection>&) noexcept override {}
  void lost(const std::shared_ptr<PacketConnection>&) noexcept override {}

  Mutex mutex_;
  std::unordered_map<std::string, std::weak_ptr<SharesMemory>> offered_ WARMFRONT_GUARDED_BY(mutex_);

  std::unique_ptr<PacketSockets> sockets_;  // last: its threads use all of the above
};

}  // namespace warmfront::server
