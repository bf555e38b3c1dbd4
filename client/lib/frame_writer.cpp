// SPDX-License-Identifier: Apache-2.0
// Each frame is one of three kinds, and each kind has a function. Thread safety as stated in the header.
#include "client/lib/frame_writer.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "client/lib/frame_cost.h"
#include "client/lib/frame_message.h"
#include "client/lib/wire.h"
#include "proto/byte_buffer.h"

namespace warmfront::client {

/// The messages of one frame, as they are written: counts their bytes, and the time between them, in which
/// they are made.
class FrameWriter::Messages {
 public:
  Messages(const FrameWriter& writer, SentFrame& frame) : writer_(writer), frame_(frame) {}

  SentFrame& frame() { return frame_; }
  bool write(const grpc::ByteBuffer& message) {
    frame_.sent_bytes += message.Length();
    frame_.encode_ms += encoding_.milliseconds();
    const StepStream::Event event = writer_.stream_.write(message, writer_.timeout_);
    encoding_ = {};
    return event == StepStream::Event::kDone;
  }

 private:
  const FrameWriter& writer_;
  SentFrame& frame_;
  Stopwatch encoding_;
};

std::optional<v1::Question> FrameWriter::question_of(const SentFrame& frame) const {
  if (frame.question == Question() || stream_.begun() == frame.number) return std::nullopt;
  return to_proto(frame.question);
}

bool FrameWriter::begin(std::uint64_t number, const Question& question) {
  v1::StreamStepsRequest request;
  v1::StepFrame& step = *request.mutable_step();
  step.set_frame(number);
  step.set_more(true);
  if (question != Question()) *step.mutable_question() = to_proto(question);
  if (stream_.write(serialize(request), timeout_) != StepStream::Event::kDone) return false;
  stream_.begun(number);
  return true;
}

bool FrameWriter::write(SentFrame& frame) {
  Messages messages(*this, frame);
  frame.answer_room.reset();
  frame.moved_block.reset();
  bool written = false;
  if (frame.commit)
    written = write_commit(messages);
  else if (const auto offset = frame.positions.offset_in(stream_.region()))
    written = write_shared(messages, *offset);
  else
    written = frame.moved ? write_moved(messages) : write_positions(messages);
  stream_.begun(std::nullopt);
  return written;
}

bool FrameWriter::write_commit(Messages& to) {
  v1::StreamStepsRequest request;
  request.mutable_commit()->set_frame(to.frame().number);
  request.mutable_commit()->set_fraction(*to.frame().commit);
  return to.write(serialize(request));
}

void FrameWriter::give_room(SentFrame& frame, v1::StepFrame& step) {
  if (SharedRegion* region = stream_.region()) frame.answer_room = region->take(answer_bytes_);
  if (!frame.answer_room) return;
  step.mutable_answer_room()->set_offset(frame.answer_room->offset);
  step.mutable_answer_room()->set_length(frame.answer_room->size);
}

bool FrameWriter::share_moved(SentFrame& frame, v1::StepFrame& step) {
  constexpr std::size_t kWorthIt = 4096;  // less is as well off in a message
  SharedRegion* region = stream_.region();
  const v1::MovedParts& moved = *frame.moved;
  const std::size_t bytes = moved.bodies().size() + moved.body_positions().size() +
                            moved.pose_bodies().size() + moved.poses().size() + moved.vertices().size() +
                            moved.vertex_positions().size();
  if (!shares_moved_ || region == nullptr || bytes < kWorthIt) return false;
  frame.moved_block = region->take(bytes);
  if (!frame.moved_block) return false;
  using Places = v1::SharedMovedParts;
  Places& places = *step.mutable_shared_moved();
  std::size_t at = 0;
  const auto put = [&](const std::string& field, v1::SharedBytes* (Places::*place)()) {
    if (field.empty()) return;
    std::memcpy(frame.moved_block->data.get() + at, field.data(), field.size());
    v1::SharedBytes& where = *(places.*place)();
    where.set_offset(frame.moved_block->offset + at);
    where.set_length(field.size());
    at += field.size();
  };
  put(moved.bodies(), &Places::mutable_bodies);
  put(moved.body_positions(), &Places::mutable_body_positions);
  put(moved.pose_bodies(), &Places::mutable_pose_bodies);
  put(moved.poses(), &Places::mutable_poses);
  put(moved.vertices(), &Places::mutable_vertices);
  put(moved.vertex_positions(), &Places::mutable_vertex_positions);
  frame.sent_bytes += bytes;
  return true;
}

bool FrameWriter::write_shared(Messages& to, std::uint64_t offset) {
  SentFrame& frame = to.frame();
  v1::StreamStepsRequest request;
  v1::StepFrame& step = *request.mutable_step();
  step.set_frame(frame.number);
  if (std::optional<v1::Question> question = question_of(frame))
    *step.mutable_question() = *std::move(question);
  step.mutable_shared_positions()->set_offset(offset);
  step.mutable_shared_positions()->set_length(frame.positions.size());
  give_room(frame, step);
  frame.sent_bytes += frame.positions.size();
  return to.write(serialize(request));
}

bool FrameWriter::write_positions(Messages& to) {
  const SentFrame& frame = to.frame();
  const std::optional<v1::Question> question = question_of(frame);
  const std::size_t size = frame.positions.size();
  std::size_t at = 0;
  do {
    const std::size_t count = std::min(chunk_bytes_, size - at);
    const bool more = at + count < size;
    const v1::Question* asked = at == 0 && question ? &*question : nullptr;
    if (!to.write(positions_message(frame.number, more, frame.positions, at, count, asked))) return false;
    at += count;
  } while (at < size);
  return true;
}

// In one message, what moved in it or in shared memory; or field by field, chunk by chunk: an empty last part
// ends the frame then.
bool FrameWriter::write_moved(Messages& to) {
  SentFrame& frame = to.frame();
  v1::StreamStepsRequest request;
  v1::StepFrame& step = *request.mutable_step();
  step.set_frame(frame.number);
  if (std::optional<v1::Question> question = question_of(frame))
    *step.mutable_question() = *std::move(question);
  const auto write_step = [&](bool more) {
    step.set_more(more);
    const bool written = to.write(serialize(request));
    step.clear_question();
    return written;
  };
  const v1::MovedParts& moved = *frame.moved;
  const bool shared = share_moved(frame, step);
  if (shared || moved.ByteSizeLong() <= chunk_bytes_) {
    if (!shared) *step.mutable_moved() = moved;
    give_room(frame, step);
    return write_step(false);
  }
  using Parts = v1::MovedParts;
  const auto send = [&](const std::string& bytes, auto set) {
    for (std::size_t at = 0; at < bytes.size(); at += chunk_bytes_) {
      step.clear_moved();
      set(*step.mutable_moved(), bytes.substr(at, chunk_bytes_));
      if (!write_step(true)) return false;
    }
    return true;
  };
  if (!send(moved.bodies(), [](Parts& part, std::string piece) { part.set_bodies(std::move(piece)); }) ||
      !send(moved.body_positions(),
            [](Parts& part, std::string piece) { part.set_body_positions(std::move(piece)); }) ||
      !send(moved.pose_bodies(),
            [](Parts& part, std::string piece) { part.set_pose_bodies(std::move(piece)); }) ||
      !send(moved.poses(), [](Parts& part, std::string piece) { part.set_poses(std::move(piece)); }) ||
      !send(moved.vertices(), [](Parts& part, std::string piece) { part.set_vertices(std::move(piece)); }) ||
      !send(moved.vertex_positions(),
            [](Parts& part, std::string piece) { part.set_vertex_positions(std::move(piece)); }))
    return false;
  step.clear_moved();
  return write_step(false);
}

}  // namespace warmfront::client
