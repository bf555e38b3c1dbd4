// SPDX-License-Identifier: Apache-2.0
// Thread safety as stated in the header.
#include "server/transport/stream_memory.h"

#include <sys/random.h>

#include <array>
#include <cstring>
#include <exception>

#include "proto/wire/shared_columns.h"

namespace warmfront::server {
namespace {

using wire::SharedColumn;

struct Column {
  SharedColumn which;
  const void* data;
  std::size_t bytes;
};

template <class T>
Column column(SharedColumn which, const std::vector<T>& values) {
  return {which, values.data(), values.size() * sizeof(T)};
}

std::array<Column, 15> columns_of(const Answer& answer) {
  return {column(SharedColumn::kKind, answer.kind),
          column(SharedColumn::kStatus, answer.status),
          answer.edge_faces.empty() ? column(SharedColumn::kVertices, answer.vertices)
                                    : column(SharedColumn::kVertices, answer.edge_faces),
          column(SharedColumn::kToi, answer.toi),
          column(SharedColumn::kWeights, answer.weights),
          column(SharedColumn::kNormal, answer.normal),
          column(SharedColumn::kPoints, answer.points),
          column(SharedColumn::kSquaredDistance, answer.squared_distance),
          column(SharedColumn::kClosest, answer.closest),
          column(SharedColumn::kDirection, answer.direction),
          column(SharedColumn::kMultiplicity, answer.multiplicity),
          column(SharedColumn::kStencil, answer.stencil),
          column(SharedColumn::kVertexDistances, answer.vertex_distances),
          column(SharedColumn::kWorlds, answer.worlds),
          column(SharedColumn::kWorldTois, answer.world_tois)};
}

}  // namespace

Outcome<std::shared_ptr<StreamMemory>> StreamMemory::create(const std::shared_ptr<Account>& account,
                                                            std::uint64_t bytes,
                                                            std::atomic<std::uint64_t>& all) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 40;
  if (bytes == 0 || bytes > kMost)
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 "shared_memory.bytes: " + std::to_string(bytes) + " is not in [1, 2^40]"};
  if (std::optional<Fault> refusal = account->refusal(bytes)) {
    refusal->message = "shared_memory.bytes: " + refusal->message;
    return *std::move(refusal);
  }
  Holding holding(account, bytes);
  Result<std::shared_ptr<SharedMapping>> mapping = SharedMapping::create(bytes);
  if (!mapping) return limit_met(mapping.error().message, "memory", true);
  holding.set(mapping.value()->size());
  return std::shared_ptr<StreamMemory>(new StreamMemory(std::move(mapping).value(), std::move(holding), all));
}

StreamMemory::StreamMemory(std::shared_ptr<SharedMapping> mapping, Holding holding,
                           std::atomic<std::uint64_t>& all)
    : mapping_(std::move(mapping)), holding_(std::move(holding)), all_(all) {
  all_ += mapping_->size();
}

StreamMemory::~StreamMemory() {
  all_ -= mapping_->size();
}

Outcome<SharedParts> take_shared_parts(v1::StepFrame& step, bool others,
                                       const std::shared_ptr<StreamMemory>& memory) {
  const v1::SharedBytes positions = step.shared_positions();
  const v1::SharedBytes room = step.answer_room();
  const bool has_positions = step.has_shared_positions();
  const bool has_room = step.has_answer_room();
  // Of no use to a recording.
  step.clear_shared_positions();
  step.clear_answer_room();
  const auto invalid = [](std::string what) {
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput, std::move(what)};
  };
  if (step.more()) return invalid("shared_positions, answer_room: are of a frame's last message");
  if (has_positions && (others || !step.positions().empty() || step.has_moved()))
    return invalid("shared_positions: the frame gives positions or what moved as well; give either");
  const auto beyond = [&](const char* field, const v1::SharedBytes& bytes) {
    return invalid(std::string(field) + ": " + std::to_string(bytes.length()) + " bytes from " +
                   std::to_string(bytes.offset()) +
                   " on are not within the stream's shared memory, which has " +
                   std::to_string(memory ? memory->mapping().size() : 0));
  };
  const auto holds = [&](const v1::SharedBytes& bytes) {
    return memory && memory->mapping().holds(bytes.offset(), bytes.length());
  };
  if (has_positions && !holds(positions)) return beyond("shared_positions", positions);
  if (has_room && !holds(room)) return beyond("answer_room", room);
  SharedParts parts;
  if (has_positions) parts.positions = memory->mapping().read(positions.offset(), positions.length());
  if (has_room) parts.room = {memory, room.offset(), room.length()};
  return parts;
}

bool put_columns(const Answer& answer, const AnswerRoom& room, v1::SharedColumns& columns) {
  const std::array<Column, 15> all = columns_of(answer);
  const std::uint64_t begin = wire::column_begins(room.offset);
  std::uint64_t end = begin;
  for (const Column& one : all)
    if (one.bytes > 0) end = wire::column_begins(end) + one.bytes;
  if (end > room.offset + room.length) return false;
  std::uint64_t at = begin;
  std::uint32_t bits = 0;
  for (const Column& one : all) {
    if (one.bytes == 0) continue;
    at = wire::column_begins(at);
    std::memcpy(room.memory->mapping().write(at), one.data, one.bytes);
    at += one.bytes;
    bits |= wire::bit_of(one.which);
  }
  columns.set_offset(begin);
  columns.set_columns(bits);
  return true;
}

Result<std::unique_ptr<MemoryDesk>> MemoryDesk::start(const std::vector<std::string>& paths, int threads) {
  std::vector<std::string> beside;
  beside.reserve(paths.size());
  for (const std::string& path : paths) beside.push_back(path + wire::kSharedMemorySuffix);
  std::unique_ptr<MemoryDesk> desk(new MemoryDesk());
  Result<std::unique_ptr<PacketSockets>> sockets = PacketSockets::listen(beside, threads, *desk);
  if (!sockets) return sockets.error();
  desk->sockets_ = std::move(sockets).value();
  desk->sockets_->begin();
  return desk;
}

MemoryDesk::~MemoryDesk() {
  // Not reset(): whose threads have not ended yet call them by this pointer.
  if (sockets_) sockets_->end();
  // What the streams wrote was written with the lock held, by threads that gRPC has joined in ways of its own.
  const MutexLock lock(mutex_);
  offered_.clear();
}

std::string MemoryDesk::offer(const std::weak_ptr<SharesMemory>& stream) {
  std::string token(16, '\0');
  if (::getrandom(token.data(), token.size(), 0) != static_cast<ssize_t>(token.size())) return {};
  const MutexLock lock(mutex_);
  offered_.emplace(token, stream);
  return token;
}

void MemoryDesk::withdraw(const std::string& token) noexcept {
  const MutexLock lock(mutex_);
  offered_.erase(token);
}

bool MemoryDesk::packet(const std::shared_ptr<PacketConnection>& from, std::string_view packet) noexcept {
  constexpr std::size_t kLongest = 1024;  // of who is not known yet
  if (packet.size() > kLongest) return false;
  try {
    v1::StreamStepsRequest request;
    if (!request.ParseFromArray(packet.data(), static_cast<int>(packet.size())) ||
        !request.has_shared_memory())
      return false;
    std::shared_ptr<SharesMemory> stream;
    {
      const MutexLock lock(mutex_);
      const auto offered = offered_.find(request.shared_memory().token());
      if (offered == offered_.end()) return false;
      stream = offered->second.lock();
      offered_.erase(offered);
    }
    if (!stream) return false;
    sockets_->keep(*from, stream);
    return stream->bind(from, request.shared_memory());
  } catch (const std::exception&) {  // no memory: as if it had not come
    return false;
  }
}

}  // namespace warmfront::server
