// SPDX-License-Identifier: Apache-2.0
// Any bytes as a message that names shared memory: the daemon refuses it with words, or what it names is
// within the memory, and an answer is put there and nowhere else. And as an answer in shared memory: the
// client refuses it, or reads within the room that it gave. One thread.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <string>

#include "client/lib/wire.h"
#include "server/session/limits.h"
#include "server/transport/stream_memory.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace warmfront;  // NOLINT: a program of its own
using fuzz::expect;

constexpr std::uint64_t kBytes = 4096;

server::Answer answer_of(std::size_t rows) {
  server::Answer answer;
  answer.kind.assign(rows, 0);
  answer.status.assign(rows, 1);
  answer.vertices.assign(rows, {0, 1, 2, 3});
  answer.toi.assign(rows, 0.5);
  answer.world_tois.assign(rows / 2, 1);
  answer.worlds.assign(rows / 2, 1);
  return answer;
}

void daemon_side(const std::string& bytes, std::size_t rows, bool alone) {
  v1::StepFrame step;
  if (!step.ParseFromString(bytes)) return;
  static server::Budget budget(std::size_t{1} << 30);
  static const auto account = server::Account::open(budget, std::size_t{1} << 29, 0).value();
  static std::atomic<std::uint64_t> all{0};
  static const auto memory = server::StreamMemory::create(account, kBytes, all).value();
  const auto parts = server::take_shared_parts(step, alone, memory);
  if (!parts) {
    expect(parts.fault().code == ErrorCode::kInvalidArgument && !parts.fault().message.empty(),
           "a frame is refused with words");
    return;
  }
  expect(!step.has_shared_positions() && !step.has_shared_moved() && !step.has_answer_room(),
         "nothing of it is left in the frame");
  server::SharedMapping& mapping = memory->mapping();
  const std::string_view whole = mapping.read(0, mapping.size());
  const auto is_within = [&](std::string_view bytes) {
    return bytes.empty() ||
           (bytes.data() >= whole.data() && bytes.data() + bytes.size() <= whole.data() + whole.size());
  };
  if (const auto positions = parts.value().positions)
    expect(is_within(*positions), "positions are within the memory");
  if (const auto moved = parts.value().moved)
    for (const std::string_view field : {moved->bodies, moved->body_positions, moved->pose_bodies,
                                         moved->poses, moved->vertices, moved->vertex_positions})
      expect(is_within(field), "what moved is within the memory");
  const server::AnswerRoom& room = parts.value().room;
  if (!room.memory) return;
  std::fill_n(mapping.write(0), mapping.size(), '\x5a');
  v1::SharedColumns columns;
  const bool put = server::put_columns(answer_of(rows), room, columns);
  for (std::uint64_t at = 0; at < whole.size(); ++at)
    if (!put || at < room.offset || at - room.offset >= room.length)
      expect(whole[at] == '\x5a', "an answer is within its room");
}

void client_side(const std::string& bytes, std::size_t room_bytes) {
  v1::StepAnswer message;
  if (!message.ParseFromString(bytes)) return;
  // Of its own, so that the sanitizer sees what is read beyond it.
  const auto room = std::make_shared<std::string>(room_bytes, '\1');
  const client::SharedRegion::Block block{std::shared_ptr<char>(room, room->data()), 64, room->size()};
  client::Answer answer;
  if (const Status appended = client::append_part(message, answer, block); !appended)
    expect(appended.error().code == ErrorCode::kInternal && !appended.error().message.empty(),
           "an answer is refused with words");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes input(data, size);
  const std::size_t how = input.next();
  const std::size_t many = input.next();
  const std::string bytes(input.rest());
  daemon_side(bytes, many, how % 2 == 0);
  client_side(bytes, 16 * many);
  return 0;
}
