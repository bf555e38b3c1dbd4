// SPDX-License-Identifier: Apache-2.0
// Replaying through a daemon, message by message. Thread safety as stated in replay_target.h.
#include <utility>

#include "client/cli/recording/replay_target.h"
#include "client/lib/connection.h"
#include "client/lib/step_stream.h"
#include "client/lib/uuid.h"

namespace warmfront::client {
namespace {

using Event = StepStream::Event;

class RemoteTarget final : public ReplayTarget {
 public:
  RemoteTarget(std::unique_ptr<Connection> connection, std::string id)
      : connection_(std::move(connection)), id_(std::move(id)) {}
  ~RemoteTarget() override {
    stream_.reset();
    static_cast<void>(connection_->remove(id_));
  }

  Status attach() {
    stream_ = std::make_unique<StepStream>(*connection_, id_);
    v1::StreamStepsRequest request;
    request.mutable_attach()->set_session_id(id_);
    v1::StreamStepsResponse response;
    if (stream_->start(deadline()) != Event::kDone ||
        stream_->write(request, connection_->options().answer_timeout) != Event::kDone ||
        stream_->read(response, deadline()) != Event::kDone || !response.has_attached())
      return ended();
    return {};
  }

  Result<AnswerDigest> step(const RecordedStep& step) override {
    v1::StreamStepsRequest request;
    if (step.commit) {
      *request.mutable_commit() = *step.commit;
      if (stream_->write(request, connection_->options().answer_timeout) != Event::kDone) return ended();
    }
    for (const v1::StepFrame& part : step.parts) {
      *request.mutable_step() = part;
      if (stream_->write(request, connection_->options().answer_timeout) != Event::kDone) return ended();
    }
    Answer answer;
    for (v1::StreamStepsResponse response; stream_->read(response, deadline()) == Event::kDone;) {
      if (response.has_error()) return remote_error_from(response.error().status()).error;
      if (!response.has_answer()) continue;  // it drains: what was sent is answered still
      if (Status appended = append_part(response.answer(), answer); !appended) return appended.error();
      if (!response.answer().last()) continue;
      if (Status finished = finish_answer(response.answer(), answer); !finished) return finished.error();
      return digest_of(answer);
    }
    return ended();
  }

  Status change(const v1::ChangeSceneRequest& request) override {
    v1::ChangeSceneRequest own = request;
    own.set_session_id(id_);
    v1::ChangeSceneResponse ignored;
    if (const auto error = connection_->change(own, ignored)) return error->error;
    return {};
  }

 private:
  StepStream::Deadline deadline() const {
    return std::chrono::system_clock::now() + connection_->options().answer_timeout;
  }
  Error ended() {
    const RemoteError error = remote_error_from(stream_->finish(deadline()));
    if (error.error.message.empty()) return {ErrorCode::kUnavailable, "the stream ended before its answers"};
    // The daemon failed, not the frame.
    return {error.error.code == ErrorCode::kInvalidArgument ? ErrorCode::kInternal : error.error.code,
            error.error.message};
  }

  const std::unique_ptr<Connection> connection_;
  const std::string id_;
  std::unique_ptr<StepStream> stream_;
};

}  // namespace

Result<std::unique_ptr<ReplayTarget>> make_remote_target(const RecordedSession& recorded,
                                                         const std::string& address,
                                                         const ClientOptions& connection) {
  const Result<Credentials> credentials = read_credentials(address, connection.security);
  if (!credentials) return credentials.error();
  auto to_daemon = std::make_unique<Connection>(address, connection, credentials.value());
  v1::GetServerInfoResponse info;
  if (const auto error = to_daemon->server_info(info)) return error->error;
  v1::SessionHeader header = recorded.session();
  header.set_session_id(random_uuid());
  const std::string_view positions = std::visit(
      [](const auto& values) {
        return std::string_view(reinterpret_cast<const char*>(values.data()),
                                values.size() * sizeof(values[0]));
      },
      recorded.positions());
  v1::CreateSessionResponse ignored;
  if (const auto error = to_daemon->create(header, recorded.scene(), positions, ignored)) return error->error;
  auto target = std::make_unique<RemoteTarget>(std::move(to_daemon), header.session_id());
  if (Status attached = target->attach(); !attached) return attached.error();
  return std::unique_ptr<ReplayTarget>(std::move(target));
}

}  // namespace warmfront::client
