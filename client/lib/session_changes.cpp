// SPDX-License-Identifier: Apache-2.0
// Changes of the scene and of the session's options, between frames. Thread safety as stated in
// session_impl.h.
#include <string>
#include <utility>
#include <vector>

#include "client/lib/changes_in_one.h"
#include "client/lib/session_impl.h"
#include "client/lib/uuid.h"

namespace warmfront::client {

Status Session::Impl::change(SceneEdit edit) {
  may_commit_ = false;  // whether or not it fails, as with Collider
  Result<v1::SceneChange> encoded = state_.encode(edit);
  if (!encoded) return encoded.error();
  for (const v1::Feature feature : features_of(edit)) {
    if (Status known = need(feature); !known) return known;
  }
  v1::ChangeSceneRequest request;
  *request.add_changes() = std::move(encoded).value();
  Status changed = carry_out(request);
  if (changed) state_.take(std::move(edit));
  return changed;
}

Status Session::Impl::change(std::vector<SceneChange> changes,
                             const std::optional<ColliderOptions>& options) {
  if (changes.empty()) return options ? change_options(*options) : Status{};
  may_commit_ = false;
  Result<ChangesInOne> in_one = ChangesInOne::create(std::move(changes), state_.float32());
  if (!in_one) return in_one.error();
  v1::ChangeSceneRequest request;
  SceneState draft = state_.draft();
  for (std::size_t i = 0; i < in_one.value().size(); ++i) {
    SceneEdit edit = in_one.value().take(i);
    Result<v1::SceneChange> encoded = draft.encode(edit);
    if (!encoded)
      return Error{encoded.error().code, "changes[" + std::to_string(i) + "]: " + encoded.error().message};
    for (const v1::Feature feature : features_of(edit)) {
      if (Status known = need(feature); !known) return known;
    }
    *request.add_changes() = std::move(encoded).value();
    draft.take(std::move(edit));
  }
  if (options) {
    if (Status known = need(v1::FEATURE_OPTION_CHANGES); !known) return known;
    Result<v1::ColliderOptions> sent = session_options(*options);
    if (!sent) return sent.error();
    *request.mutable_options() = std::move(sent).value();
  }
  Status changed = carry_out(request);
  if (!changed) return changed;
  state_ = std::move(draft);
  if (options) *header_.mutable_options() = request.options();
  return changed;
}

Status Session::Impl::change_options(const ColliderOptions& options) {
  may_commit_ = false;
  if (Status known = need(v1::FEATURE_OPTION_CHANGES); !known) return known;
  v1::ChangeSceneRequest request;
  Result<v1::ColliderOptions> sent = session_options(options);
  if (!sent) return sent.error();
  *request.mutable_options() = std::move(sent).value();
  Status changed = carry_out(request);
  if (changed) *header_.mutable_options() = request.options();
  return changed;
}

Status Session::Impl::check_idle() const {
  if (unanswered_.empty() && submitted_.empty()) return {};
  return Error{ErrorCode::kFailedPrecondition, "frames are unanswered; take their answers first"};
}

// Of a daemon that is not there the change itself will tell.
Status Session::Impl::need(v1::Feature feature) {
  if (failed_) return *failed_;
  const std::optional<RemoteError> error = connection_->need({&feature, 1}, id());
  if (error && error->error.code == ErrorCode::kUnimplemented) return error->error;
  return {};
}

Status Session::Impl::carry_out(v1::ChangeSceneRequest& request) {
  if (failed_) return *failed_;
  if (Status idle = check_idle(); !idle) return idle;
  request.set_session_id(id());
  request.set_next_frame(header_.first_frame() + 1);
  request.set_key(random_uuid());
  changing_ = true;
  for (;;) {
    request.clear_expected_state();
    if (known_) *request.mutable_expected_state() = *known_;
    v1::ChangeSceneResponse response;
    std::optional<RemoteError> error = connection_->change(request, response);
    if (!error) {
      changing_ = false;
      last_trial_.reset();
      header_.set_first_revision(header_.first_revision() + 1);
      known_ = response.has_state() ? std::optional(response.state()) : std::nullopt;
      resumes_without_answer_ = 0;
      return {};
    }
    // This session's next frame: a copy that expects another one is not this session.
    if (error->reason == v1::ERROR_REASON_FRAME_OUT_OF_ORDER) error->reason = v1::ERROR_REASON_STATE_CHANGED;
    const bool refused = error->retry_after || !error->may_resume();
    const Status resumed = refused ? Status{} : resume(*error);
    if (refused || !resumed) {
      changing_ = false;
      return refused ? error->error : resumed.error();
    }
  }
}

}  // namespace warmfront::client
