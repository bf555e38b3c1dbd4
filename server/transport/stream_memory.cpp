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

Fault invalid(std::string what) {
  return {ErrorCode::kInvalidArgument, Reason::kInvalidInput, std::move(what)};
}

Fault beyond(const char* field, const v1::SharedBytes& bytes, const std::shared_ptr<StreamMemory>& memory) {
  return invalid(std::string(field) + ": " + std::to_string(bytes.length()) + " bytes from " +
                 std::to_string(bytes.offset()) +
                 " on are not within the stream's shared memory, which has " +
                 std::to_string(memory ? memory->mapping().size() : 0));
}

/// `at` finds the bytes of a field, by its name.
template <class At>
MovedPiece moved_at(const v1::SharedMovedParts& places, At at) {
  return {.bodies = at("shared_moved.bodies", places.bodies()),
          .body_positions = at("shared_moved.body_positions", places.body_positions()),
          .pose_bodies = at("shared_moved.pose_bodies", places.pose_bodies()),
          .poses = at("shared_moved.poses", places.poses()),
          .vertices = at("shared_moved.vertices", places.vertices()),
          .vertex_positions = at("shared_moved.vertex_positions", places.vertex_positions())};
}

std::size_t bytes_of(const MovedPiece& piece) {
  return piece.bodies.size() + piece.body_positions.size() + piece.pose_bodies.size() + piece.poses.size() +
         piece.vertices.size() + piece.vertex_positions.size();
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
  const bool has_positions = step.has_shared_positions();
  const bool has_moved = step.has_shared_moved();
  if (step.more())
    return invalid("shared_positions, shared_moved, answer_room: are of a frame's last message");
  if ((has_positions || has_moved) &&
      (others || !step.positions().empty() || step.has_moved() || (has_positions && has_moved)))
    return invalid(std::string(has_positions ? "shared_positions" : "shared_moved") +
                   ": the frame gives positions or what moved as well; give either");
  SharedParts parts;
  std::optional<Fault> fault;
  const auto at = [&](const char* field, const v1::SharedBytes& bytes) -> std::string_view {
    if (memory && memory->mapping().holds(bytes.offset(), bytes.length()))
      return memory->mapping().read(bytes.offset(), bytes.length());
    if (!fault) fault = beyond(field, bytes, memory);
    return {};
  };
  if (has_positions) parts.positions = at("shared_positions", step.shared_positions());
  if (has_moved) parts.moved = moved_at(step.shared_moved(), at);
  if (!fault && parts.moved && bytes_of(*parts.moved) > memory->mapping().size())
    fault = invalid(
        "shared_moved: its fields overlap, as together they are longer than the memory; give each its own "
        "place");
  if (const v1::SharedBytes& room = step.answer_room();
      step.has_answer_room() && !at("answer_room", room).empty())
    parts.room = {memory, room.offset(), room.length()};
  if (fault) return *std::move(fault);
  // Of no use to a recording, unless they are why the frame is refused.
  step.clear_shared_positions();
  step.clear_shared_moved();
  step.clear_answer_room();
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

Result<std::unique_ptr<MemoryDesk>> MemoryDesk::start(const std::vector<std::string>& paths, int threads,
                                                      std::chrono::microseconds spin) {
  std::vector<std::string> beside;
  beside.reserve(paths.size());
  for (const std::string& path : paths) beside.push_back(path + wire::kSharedMemorySuffix);
  std::unique_ptr<MemoryDesk> desk(new MemoryDesk());
  Result<std::unique_ptr<PacketSockets>> sockets = PacketSockets::listen(beside, threads, spin, *desk);
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
