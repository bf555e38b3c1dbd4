// SPDX-License-Identifier: Apache-2.0
// The life of a session: made, looked at, held by a stream, closed. Its frames: session_frames.cpp; changes
// of its scene: session_changes.cpp; what is around both, and the self-check: session_turn.h and its source.
// Thread safety as stated in the header.
#include "server/session/session.h"

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

#include "engine/stop.h"
#include "server/session/session_turn.h"

namespace warmfront::server {
namespace {

/// Of what a session is created from.
std::uint64_t digest_of(const SessionSpec& spec, const PositionBuffer& positions) {
  StateDigest digest(spec.header_digest);
  digest.add(std::span(spec.scene.faces));
  digest.add(positions.hash());
  const PairFilters& filters = spec.scene.filters;
  if (filters.any()) {
    digest.add(std::span(filters.rest_positions));
    digest.add(std::span(filters.excluded_vertex_pairs));
    digest.add(std::span(filters.patches));
  }
  if (!spec.scene.thickness.empty()) digest.add(std::span(spec.scene.thickness));
  if (!spec.scene.edges.empty()) digest.add(std::span(spec.scene.edges));
  return digest.value();
}

}  // namespace

Session::InHand::InHand(std::shared_ptr<Session> session) : session_(std::move(session)) {
  const MutexLock lock(session_->mutex_);
  ++session_->in_hand_;
}

Session::InHand::~InHand() {
  const MutexLock lock(session_->mutex_);
  --session_->in_hand_;
  session_->last_request_ = std::chrono::steady_clock::now();
}

Outcome<std::shared_ptr<Session>> Session::create(SessionSpec spec, const PositionBuffer& positions,
                                                  Host host) {
  try {
    const std::uint64_t digest = digest_of(spec, positions);
    Result<Scene> scene = Scene::create(std::move(spec.scene), StopSignal(host.given_up));
    if (!scene) return fault_from(scene.error());
    auto shared = std::make_shared<const Scene>(std::move(scene).value());
    Result<Collider> collider =
        Collider::create(shared, positions.view(), spec.options, host.workers, host.given_up);
    if (!collider) return fault_from(collider.error(), {}, kAdjacentFaces);
    if (Status placed = collider.value().place(spec.poses, host.given_up); !placed)
      return fault_from(placed.error());
    return std::shared_ptr<Session>(new Session(std::move(spec), digest, std::move(shared),
                                                std::move(collider).value(), std::move(host)));
  } catch (const Stopped&) {
    return Fault{ErrorCode::kCancelled, Reason::kCancelled,
                 "creating the session: given up by its client; it may be created again"};
  } catch (const std::bad_alloc&) {
    return no_memory("creating the session");
  } catch (const std::exception& error) {
    return engine_failed("creating the session", error.what());
  }
}

Session::Session(SessionSpec&& spec, std::uint64_t digest, std::shared_ptr<const Scene> scene,
                 Collider&& collider, Host&& host)
    : id_(std::move(spec.id)),
      owner_(std::move(host.owner)),
      observer_(host.observer),
      dtype_(spec.dtype),
      created_(std::chrono::system_clock::now()),
      lost_(std::move(host.lost)),
      rebuilt_(std::move(host.rebuilt)),
      runner_(host.runner),
      workers_(std::move(host.workers)),
      limits_(host.limits),
      tenant_(std::move(host.tenant)),
      mailbox_(std::make_shared<Mailbox>(
          host.runner, host.limits.window, StepForecast(scene->element_count()).lane(),
          tenant_ ? std::shared_ptr<Share>(tenant_, &tenant_->share) : std::shared_ptr<Share>())),
      account_(std::move(host.account)),
      companion_(std::move(host.companion)),
      spare_(account_),
      collider_(std::move(collider)),
      memory_(account_, collider_.memory_bytes()),
      history_({spec.first_frame, spec.first_revision, digest}),
      forecast_(scene->element_count()),
      scene_(std::move(scene)),
      options_(collider_.options()),
      last_request_(std::chrono::steady_clock::now()) {
  snapshot_.state = history_.now();
}

SessionSnapshot Session::snapshot() const {
  const MutexLock lock(mutex_);
  SessionSnapshot snapshot = snapshot_;
  snapshot.memory_bytes = account_->held();
  snapshot.attached = attachment_.has_value();
  snapshot.created = created_;
  snapshot.in_hand = in_hand_ > 0;
  if (!snapshot.in_hand)
    snapshot.idle = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() -
                                                                          last_request_);
  return snapshot;
}

void Session::touch() {
  const MutexLock lock(mutex_);
  last_request_ = std::chrono::steady_clock::now();
}

bool Session::used() const {
  const MutexLock lock(mutex_);
  return attachments_ > 0 || snapshot_.steps > 0;
}

std::optional<Fault> Session::closed() const {
  const MutexLock lock(mutex_);
  return closed_;
}

std::shared_ptr<const Scene> Session::scene() const {
  const MutexLock lock(mutex_);
  return scene_;
}

ColliderOptions Session::options() const {
  const MutexLock lock(mutex_);
  return options_;
}

Fault Session::taken_over() const {
  return {ErrorCode::kAborted, Reason::kSessionAttached,
          "session " + id_.text() + " was taken over by another stream"};
}

Outcome<Session::Attachment> Session::attach(Claim claim, Evict evict, AttachDone done) {
  // All that may throw comes first: a stream that is not told of its attachment could never give it back.
  const auto number = std::make_shared<Attachment>();
  Mailbox::Entry entry = mailbox_->prepare([self = shared_from_this(), number, done = std::move(done)] {
    self->holder_ = std::max(self->holder_, *number);
    try {
      if (std::optional<Fault> fault = self->closed()) return done(*std::move(fault));
      done(self->history_.standing());
    } catch (...) {
      done(no_memory("attach"));
    }
  });
  const Fault fault = taken_over();
  Evict evicted;
  Attachment attachment{};
  {
    const MutexLock lock(mutex_);
    if (closed_) return *closed_;
    if (!claim.client_id.empty() && claim.client_id == client_id_ && claim.attempt <= attempt_)
      return Fault{ErrorCode::kAborted, Reason::kSessionAttached,
                   "session " + id_.text() + ": attach " + std::to_string(claim.attempt) +
                       " of this client came after its attach " + std::to_string(attempt_) +
                       "; a stream that was given up came late"};
    if (attachment_ && !claim.takeover)
      return Fault{
          ErrorCode::kAborted, Reason::kSessionAttached,
          "session " + id_.text() + " is held by another stream; detach that one, or attach with takeover"};
    evicted = std::exchange(evict_, std::move(evict));
    attachment = *number = Attachment{++attachments_};
    attachment_ = attachment;
    client_id_ = std::move(claim.client_id);
    attempt_ = claim.attempt;
    last_request_ = std::chrono::steady_clock::now();
  }
  if (evicted) evicted(fault);
  mailbox_->post_always(std::move(entry));
  return attachment;
}

void Session::detach(Attachment attachment) {
  Evict evict;  // destroyed outside the lock: it may hold the stream
  const MutexLock lock(mutex_);
  if (attachment_ != attachment) return;
  attachment_.reset();
  evict.swap(evict_);
  last_request_ = std::chrono::steady_clock::now();
}

void Session::close(Fault fault) {
  Fault copy = fault;
  Evict evict;
  {
    const MutexLock lock(mutex_);
    if (closed_) return;
    closed_ = std::move(copy);
    if (running_ != nullptr) *running_ = true;
    evict.swap(evict_);
  }
  if (evict) evict(fault);
}

void Session::close_as(const char* what) noexcept {
  try {
    close({ErrorCode::kNotFound, Reason::kSessionNotFound,
           "session " + id_.text() + " " + what + "; create it again"});
  } catch (...) {
    close({ErrorCode::kNotFound, Reason::kSessionNotFound, "session gone"});
  }
}

}  // namespace warmfront::server
