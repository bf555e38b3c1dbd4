// SPDX-License-Identifier: Apache-2.0
// Recording in the client. Thread safety as stated in the header.
#include "client/cli/recording/recorder.h"

#include <cstdio>
#include <string_view>
#include <utility>

#include "client/cli/bench/machine.h"
#include "client/cli/recording/from_wire.h"
#include "client/lib/uuid.h"
#include "client/lib/wire.h"
#include "proto/wire/codes.h"

namespace warmfront::client {
namespace {

constexpr std::size_t kUploadChunk = std::size_t{1} << 20;

void set_outcome(v1::RecordedOutcome& outcome, const Error& error) {
  outcome.set_code(wire::canonical_code(error.code));
  outcome.set_message(error.message);
}

class RecordingStepper final : public Stepper {
 public:
  RecordingStepper(std::unique_ptr<Stepper> inner, Recorder recorder)
      : inner_(std::move(inner)), recorder_(std::move(recorder)) {}

  Result<StepAnswer> step(const Frame& frame) override {
    recorder_.frame(next_, frame);
    Result<StepAnswer> answer = inner_->step(frame);
    if (answer)
      recorder_.answer(next_++, digest_of(answer.value()));
    else
      recorder_.refusal(next_, answer.error());
    return answer;
  }
  // A change, and a placement of everything.
  Status replace(std::vector<ReplacedBody> bodies, const Positions& positions) override {
    recorder_.change(next_, bodies, positions);
    Status replaced = inner_->replace(std::move(bodies), positions);
    recorder_.changed(replaced);
    if (!replaced) return replaced;
    Question placement;
    placement.kind = QuestionKind::kPlace;
    recorder_.frame(next_, Frame(positions), placement);
    recorder_.answer(next_++, digest_of(StepAnswer()));
    return replaced;
  }
  Status place(const Frame& /*frame*/) override {
    return Error{ErrorCode::kUnimplemented, "what is recorded here moves by steps alone"};
  }
  int threads() const override { return inner_->threads(); }

 private:
  std::unique_ptr<Stepper> inner_;
  Recorder recorder_;
  std::uint64_t next_ = 1;
};

}  // namespace

Result<Recorder> Recorder::create(const std::string& path, const SceneDescription& scene,
                                  const Positions& positions, const ColliderOptions& options,
                                  const Frame& placed) {
  const auto warn = [path](const std::string& reason) {
    std::fprintf(stderr, "warmfront: the recording %s stops here: %s\n", path.c_str(), reason.c_str());
  };
  auto writer = recording::Writer::create(path, "warmfront " + this_build().version, {.stopped = warn});
  if (!writer) return writer.error();
  Recorder recorder(std::move(writer).value(), SceneState(scene, positions));
  if (!placed.empty()) {
    const Result<SentFrame> sent = recorder.state_.encode(placed);
    if (!sent) return sent.error();
    recorder.state_.take(sent.value());
  }
  v1::RecordedMessage message;
  v1::SessionHeader& header = *message.mutable_create()->mutable_header();
  header.set_session_id(random_uuid());
  *header.mutable_options() = to_proto(options);
  recorder.state_.describe(header);
  recorder.writer_->write(message);
  using Request = v1::CreateSessionRequest;
  const auto write = [&](const Request& piece) {
    *message.mutable_create() = piece;
    recorder.writer_->write(message);
    return true;
  };
  wire::send_chunks(wire::as_bytes(scene.faces), kUploadChunk, write,
                    [](Request& to, std::string bytes) { to.set_faces(std::move(bytes)); });
  wire::send_chunks(wire::as_bytes(scene.edges), kUploadChunk, write,
                    [](Request& to, std::string bytes) { to.set_edges(std::move(bytes)); });
  wire::send_chunks(recorder.state_.positions(), kUploadChunk, write,
                    [](Request& to, std::string bytes) { to.set_positions(std::move(bytes)); });
  wire::upload_thickness(scene.thickness, kUploadChunk, write);
  wire::upload(recorder.state_.scene().filters, kUploadChunk, write);
  return recorder;
}

Recorder::~Recorder() {
  if (writer_ && !has_frames_) writer_->discard();
}

void Recorder::frame(std::uint64_t number, const Frame& frame, const Question& question) {
  has_frames_ = true;
  Result<SentFrame> sent = state_.encode(frame);
  if (!sent) return writer_->stop("frame " + std::to_string(number) + ": " + sent.error().message);
  v1::RecordedMessage message;
  v1::StepFrame& step = *message.mutable_step();
  step.set_frame(number);
  if (question != Question()) *step.mutable_question() = to_proto(question);
  if (sent.value().moved)
    *step.mutable_moved() = *std::move(sent.value().moved);
  else
    step.set_positions(std::string(sent.value().positions.view()));
  writer_->write(std::move(message));
}

void Recorder::answer(std::uint64_t number, const AnswerDigest& digest) {
  v1::RecordedMessage message;
  v1::RecordedAnswer& answer = *message.mutable_answer();
  answer.set_frame(number);
  answer.mutable_outcome();
  answer.set_vf(digest.vf);
  answer.set_ee(digest.ee);
  answer.set_vh(digest.vh);
  answer.set_possible(digest.possible);
  if (digest.earliest_toi) answer.set_earliest_toi(*digest.earliest_toi);
  answer.set_contacts_hash(digest.contacts_hash);
  writer_->write(std::move(message));
}

void Recorder::refusal(std::uint64_t number, const Error& error) {
  v1::RecordedMessage message;
  v1::RecordedAnswer& answer = *message.mutable_answer();
  answer.set_frame(number);
  set_outcome(*answer.mutable_outcome(), error);
  writer_->write(std::move(message));
}

void Recorder::change(std::uint64_t next, const std::vector<ReplacedBody>& bodies,
                      const Positions& positions) {
  v1::RecordedMessage message;
  v1::ChangeSceneRequest& request = *message.mutable_change();
  request.set_next_frame(next);
  for (const ReplacedBody& body : bodies) {
    SceneEdit edit =
        PutBody{body.index, body.with, rows_of(positions, body.first_vertex, body.with.body.vertex_count)};
    Result<v1::SceneChange> change = state_.encode(edit);
    if (!change)
      return writer_->stop("the change before frame " + std::to_string(next) + ": " + change.error().message);
    *request.add_changes() = std::move(change).value();
    state_.take(std::move(edit));
  }
  writer_->write(std::move(message));
}

void Recorder::changed(const Status& status) {
  v1::RecordedMessage message;
  v1::RecordedOutcome& outcome = *message.mutable_changed();
  if (!status) set_outcome(outcome, status.error());
  writer_->write(std::move(message));
}

std::unique_ptr<Stepper> make_recording_stepper(std::unique_ptr<Stepper> inner, Recorder recorder) {
  return std::make_unique<RecordingStepper>(std::move(inner), std::move(recorder));
}

}  // namespace warmfront::client
