// SPDX-License-Identifier: Apache-2.0
// Records to events. Thread safety as stated in the header.
#include "client/cli/recording/recorded_session.h"

#include <utility>

#include "client/cli/recording/from_wire.h"
#include "proto/wire/chunked_array.h"
#include "proto/wire/filters.h"

namespace warmfront::client {

Result<RecordedSession> RecordedSession::open(const std::string& path) {
  Result<recording::Reader> reader = recording::Reader::open(path);
  if (!reader) return reader.error();
  RecordedSession recorded(std::move(reader).value());
  if (Status read = recorded.read_upload(); !read) return read.error();
  return recorded;
}

Status RecordedSession::advance() {
  record_at_ = reader_.at();
  auto record = reader_.next();
  if (!record) return record.error();
  next_ = std::move(record).value();
  return {};
}

Status RecordedSession::read_upload() {
  if (Status read = advance(); !read) return read.error();
  const std::uint64_t begin = record_at_;
  if (next_ && next_->has_end() && !next_->end().complete())
    return reader_.error(
        begin, "it was stopped before the upload, and has nothing to replay: " + next_->end().reason());
  if (!next_ || !next_->has_create() || !next_->create().has_header())
    return reader_.error(begin, "an upload is expected behind the header, its own header first");
  session_ = next_->create().header();
  std::string faces, positions;
  auto filters = wire::FiltersUpload::announced(session_.filters(), session_.vertex_count());
  if (!filters) return reader_.error(begin, "the upload: " + filters.error().message);
  wire::ChunkedArray<double> thickness("thickness",
                                       session_.vertex_thickness() ? session_.vertex_count() : 0);
  wire::ChunkedArray<std::array<std::int32_t, 2>> edges("edges", session_.edge_count());
  for (;;) {
    if (Status read = advance(); !read) return read.error();
    if (!next_ || !next_->has_create()) break;
    if (next_->create().has_header()) return reader_.error(record_at_, "a second upload");
    faces += next_->create().faces();
    positions += next_->create().positions();
    if (Status added = filters.value().add(next_->create()); !added)
      return reader_.error(record_at_, "the upload: " + added.error().message);
    if (Status added = thickness.append(next_->create().thickness()); !added)
      return reader_.error(record_at_, "the upload: " + added.error().message);
    if (Status added = edges.append(next_->create().edges()); !added)
      return reader_.error(record_at_, "the upload: " + added.error().message);
  }
  if (next_ && next_->has_end() && !next_->end().complete())
    return reader_.error(
        record_at_, "it was stopped within the upload, and has nothing to replay: " + next_->end().reason());
  const auto invalid = [&](const Error& error) {
    return reader_.error(begin, "the upload: " + error.message);
  };
  if (session_.dtype() != v1::DTYPE_FLOAT32 && session_.dtype() != v1::DTYPE_FLOAT64)
    return invalid({{}, "dtype: neither float32 nor float64"});
  if (faces.size() != std::uint64_t{12} * session_.face_count())
    return invalid({{},
                    std::to_string(faces.size()) + " bytes of faces, but " +
                        std::to_string(std::uint64_t{12} * session_.face_count()) + " are announced"});
  auto scene = scene_of(session_);
  if (!scene) return invalid(scene.error());
  scene_ = std::move(scene).value();
  auto face_list = faces_of(faces, "faces");
  if (!face_list) return invalid(face_list.error());
  scene_.faces = std::move(face_list).value();
  if (Status complete = filters.value().complete(); !complete) return invalid(complete.error());
  scene_.filters = filters.value().take();
  if (Status complete = thickness.complete(); !complete) return invalid(complete.error());
  scene_.thickness = thickness.take();
  if (Status complete = edges.complete(); !complete) return invalid(complete.error());
  scene_.edges = edges.take();
  auto options = options_of(session_.options());
  if (!options) return invalid(options.error());
  options_ = options.value();
  auto placed = positions_of(positions, float32(), session_.vertex_count(), "positions");
  if (!placed) return invalid(placed.error());
  positions_ = std::move(placed).value();
  auto poses = poses_of(session_);
  if (!poses) return invalid(poses.error());
  poses_ = std::move(poses).value();
  return {};
}

Result<std::optional<RecordedEvent>> RecordedSession::read_step() {
  RecordedStep step;
  step.frame = next_->step().frame();
  for (bool more = true; more;) {
    if (!next_) {  // cut off within the frame
      cut_off_ = true;
      return std::optional<RecordedEvent>();
    }
    if (!next_->has_step() || next_->step().frame() != step.frame)
      return reader_.error(record_at_, "the rest of frame " + std::to_string(step.frame) + " is expected");
    more = next_->step().more();
    step.parts.push_back(std::move(*next_->mutable_step()));
    if (Status read = advance(); !read) return read.error();
  }
  return with_answer(std::move(step));
}

Result<std::optional<RecordedEvent>> RecordedSession::read_commit() {
  RecordedStep step;
  step.frame = next_->commit().frame();
  step.commit = next_->commit();
  if (Status read = advance(); !read) return read.error();
  return with_answer(std::move(step));
}

Result<std::optional<RecordedEvent>> RecordedSession::with_answer(RecordedStep step) {
  cut_off_ = !next_ || !next_->has_answer();
  if (!cut_off_) {
    if (next_->answer().frame() != step.frame)
      return reader_.error(record_at_, "the answer to frame " + std::to_string(step.frame) + " is expected");
    step.answer = std::move(*next_->mutable_answer());
    if (Status read = advance(); !read) return read.error();
  } else if (next_ && !next_->has_end()) {
    return reader_.error(record_at_, "the answer to frame " + std::to_string(step.frame) + " is expected");
  }
  return std::optional<RecordedEvent>(std::move(step));
}

Result<std::optional<RecordedEvent>> RecordedSession::next() {
  if (!next_) return std::optional<RecordedEvent>();
  switch (next_->what_case()) {
    case v1::RecordedMessage::kStep:
      return read_step();
    case v1::RecordedMessage::kCommit:
      return read_commit();
    case v1::RecordedMessage::kChange: {
      RecordedChange change{std::move(*next_->mutable_change()), std::nullopt};
      if (Status read = advance(); !read) return read.error();
      cut_off_ = !next_ || next_->has_end();
      if (!cut_off_) {
        if (!next_->has_changed()) return reader_.error(record_at_, "a change's outcome is expected");
        change.outcome = std::move(*next_->mutable_changed());
        if (Status read = advance(); !read) return read.error();
      }
      return std::optional<RecordedEvent>(std::move(change));
    }
    case v1::RecordedMessage::kEnd:
      end_ = std::move(*next_->mutable_end());
      if (Status read = advance(); !read) return read.error();
      if (next_) return reader_.error(record_at_, "the recording goes on behind its end");
      return std::optional<RecordedEvent>();
    default:
      return reader_.error(record_at_, "a step, a commit, a change or the end is expected");
  }
}

std::string RecordedSession::defect() const {
  if (reader_.torn_bytes() > 0)
    return "its last record is cut off (" + std::to_string(reader_.torn_bytes()) +
           " bytes left out): it is being written still, or its writer was killed";
  if (end_ && !end_->complete()) return "it was stopped: " + end_->reason();
  if (!end_) return "it has no end: it is being written still, or its writer was killed";
  if (cut_off_) return "its last step has no answer";
  return "";
}

}  // namespace warmfront::client
