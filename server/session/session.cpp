// SPDX-License-Identifier: Apache-2.0
// Stepping a session by its frame rule. Thread safety as stated in the header.
#include "server/session/session.h"

#include <exception>
#include <new>
#include <utility>

#include "server/session/step_cost.h"

namespace warmfront::server {
namespace {

Fault out_of_memory(const std::string& what) {
  return {ErrorCode::kResourceExhausted, Reason::kEngine,
          what +
              ": the daemon ran out of memory; the session is dropped, use a smaller scene or lower "
              "max_front_bytes"};
}

std::string name_of(std::uint64_t frame) {
  return "frame " + std::to_string(frame);
}

Fault cancelled(std::uint64_t frame) {
  return {ErrorCode::kCancelled, Reason::kCancelled,
          name_of(frame) + ": given up by its client; the session is as before it"};
}

}  // namespace

Outcome<std::shared_ptr<Session>> Session::create(SessionSpec spec, const PositionBuffer& positions,
                                                  Host host) {
  try {
    Result<Scene> scene = Scene::create(std::move(spec.scene));
    if (!scene) return fault_from(scene.error());
    auto shared = std::make_shared<const Scene>(std::move(scene).value());
    Result<Collider> collider =
        Collider::create(shared, positions.view(), spec.options, std::move(host.workers));
    if (!collider) return fault_from(collider.error());
    if (Status placed = collider.value().place(spec.poses); !placed) return fault_from(placed.error());
    return std::shared_ptr<Session>(
        new Session(std::move(spec), std::move(shared), std::move(collider).value(), std::move(host)));
  } catch (const std::bad_alloc&) {
    return out_of_memory("creating the session");
  } catch (const std::exception& error) {
    return Fault{ErrorCode::kInternal, Reason::kEngine, std::string("creating the session: ") + error.what()};
  }
}

Session::Session(SessionSpec&& spec, std::shared_ptr<const Scene> scene, Collider&& collider, Host&& host)
    : id_(std::move(spec.id)),
      owner_(std::move(host.owner)),
      metrics_(host.metrics),
      dtype_(spec.dtype),
      options_(collider.options()),
      created_(std::chrono::system_clock::now()),
      lost_(std::move(host.lost)),
      rebuilt_(std::move(host.rebuilt)),
      runner_(host.runner),
      limits_(host.limits),
      mailbox_(std::make_shared<Mailbox>(host.runner, host.limits.window,
                                         lane_of(step_cost_ms(scene->face_count(), {})))),
      account_(std::move(host.account)),
      recording_(std::move(host.recording)),
      collider_(std::move(collider)),
      memory_(account_, collider_.memory_bytes()),
      frames_(spec.first_frame),
      next_ms_(step_cost_ms(scene->face_count(), {})),
      scene_(std::move(scene)),
      last_request_(std::chrono::steady_clock::now()) {
  snapshot_.last_frame = frames_.last();
}

SessionSnapshot Session::snapshot() const {
  const MutexLock lock(mutex_);
  SessionSnapshot snapshot = snapshot_;
  snapshot.memory_bytes = account_->held();
  snapshot.attached = attachment_.has_value();
  snapshot.created = created_;
  snapshot.idle =
      std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - last_request_);
  return snapshot;
}

std::optional<Fault> Session::closed() const {
  const MutexLock lock(mutex_);
  return closed_;
}

std::shared_ptr<const Scene> Session::scene() const {
  const MutexLock lock(mutex_);
  return scene_;
}

void Session::step(std::uint64_t frame, FrameBuffer contents, FramePass pass, Admission admission,
                   StepDone done, Before before) {
  {
    const MutexLock lock(mutex_);
    last_request_ = std::chrono::steady_clock::now();
  }
  // Shared, because a std::function must be copyable and the reply is used by whichever of the two paths is
  // taken.
  auto request = std::make_shared<Request>(
      Request{frame, std::move(contents), std::move(pass), std::move(done), std::move(before)});
  Mailbox::Job job = [self = shared_from_this(), request] {
    if (request->before) request->before();
    Outcome<std::shared_ptr<const Answer>> outcome = self->compute_guarded(*request);
    // The frame is computed: what it held is free before its client hears of it.
    request->pass.give_back();
    request->done(std::move(outcome));
  };
  if (admission == Admission::kAlways) {
    mailbox_->run_or_post(std::move(job));
  } else if (!mailbox_->post(std::move(job), Mailbox::Kind::kStep)) {
    request->done(
        limit_met(name_of(frame) + ": too many frames of this session wait; send it again after an answer",
                  "window", true));
  }
}

void Session::change(std::uint64_t next_frame, std::vector<SceneChange> changes, ChangeDone done,
                     Before before) {
  auto shared = std::make_shared<std::vector<SceneChange>>(std::move(changes));
  auto reply = std::make_shared<ChangeDone>(std::move(done));
  const bool posted =
      mailbox_->post([self = shared_from_this(), next_frame, shared, reply, before = std::move(before)] {
        if (before) before();
        const Outcome<bool> outcome = self->guarded<bool>("changing the scene", [&]() -> Outcome<bool> {
          if (std::optional<Fault> fault = self->apply(next_frame, *shared)) return *std::move(fault);
          return true;
        });
        (*reply)(outcome ? std::nullopt : std::optional<Fault>(outcome.fault()));
      });
  if (!posted)
    (*reply)(limit_met("ChangeScene: too many frames of this session wait; try again after an answer",
                       "window", true));
}

template <class T>
Outcome<T> Session::guarded(const std::string& what, const std::function<Outcome<T>()>& work) {
  stepped_ = false;
  Outcome<T> outcome = [&]() -> Outcome<T> {
    if (std::optional<Fault> fault = closed()) return *std::move(fault);
    try {
      std::optional<Workers::OneThread> one_thread;
      if (runner_.takes_one_thread(lane_of(next_ms_))) one_thread.emplace();
      return work();
    } catch (const std::bad_alloc&) {
      return out_of_memory(what);
    } catch (const std::exception& error) {
      return Fault{ErrorCode::kInternal, Reason::kEngine, what + ": the engine failed: " + error.what()};
    }
  }();
  if (!outcome && outcome.fault().engine_failed()) {
    close({ErrorCode::kNotFound, Reason::kSessionNotFound,
           "session " + id_.text() + " was dropped after a failure of the engine; create it again"});
    lost_(*this, outcome.fault());
    return outcome;
  }
  take_stock();
  return outcome;
}

void Session::take_stock() {
  memory_.set(collider_.memory_bytes() + (last_frame_ ? last_frame_->memory_bytes() : 0));
  plan_next();
  const MutexLock lock(mutex_);
  snapshot_.last_frame = frames_.last();
  snapshot_.steps = frames_.steps();
  last_request_ = std::chrono::steady_clock::now();
}

// Only what follows a step is foreseen to be brief: the first of a changed scene, or of one whose warmth is
// gone, may take long, and so may the frame again that was given up. A check takes a time of its own, and the
// disk of a recording what it likes.
void Session::plan_next() {
  const std::uint64_t faces = collider_.scene().face_count();
  next_ms_ = step_cost_ms(faces, last_answer_ ? last_answer_->statistics.counts : StepCounts{});
  if (last_answer_ && last_answer_->all_deformable)
    next_ms_ += step_cost_ms(faces, last_answer_->all_deformable->statistics.counts);
  const bool foreseen = stepped_ && !check_is_due() && !recording_;
  mailbox_->foresee(lane_of(next_ms_), foreseen ? next_ms_ : Mailbox::kUnforeseen);
}

bool Session::check_is_due() const {
  return limits_.self_check_steps > 0 && steps_unchecked_ >= limits_.self_check_steps;
}

Outcome<std::shared_ptr<const Answer>> Session::compute_guarded(Request& request) {
  return guarded<std::shared_ptr<const Answer>>(name_of(request.frame), [&] { return compute(request); });
}

void Session::check(CheckDone done) {
  auto reply = std::make_shared<CheckDone>(std::move(done));
  const bool posted = mailbox_->post([self = shared_from_this(), reply] {
    (*reply)(self->guarded<std::string>("the self-check", [&] { return self->self_check(""); }));
  });
  if (!posted)
    (*reply)(limit_met("CheckSession: too many frames of this session wait; try again after an answer",
                       "window", true));
}

Outcome<std::string> Session::self_check(const std::string& where) {
  steps_unchecked_ = 0;
  const Status sound = collider_.self_check();
  const bool lost = !sound && (sound.error().code == ErrorCode::kDataLoss || was_rebuilt_);
  if (metrics_ != nullptr)
    ++metrics_->self_checks[sound ? Metrics::kPassed : lost ? Metrics::kDataLost : Metrics::kRebuilt];
  if (sound) return std::string();
  const std::string& found = sound.error().message;
  if (lost)
    return Fault{ErrorCode::kDataLoss, Reason::kDataLoss,
                 where + found + (was_rebuilt_ ? ", after it was made anew once" : "") +
                     "; the session is dropped, create it again"};
  was_rebuilt_ = true;
  steps_unchecked_ = limits_.self_check_steps;  // what comes of it is checked after a step
  collider_.forget_warmth();
  if (rebuilt_) rebuilt_(*this, found);
  return found;
}

// Here and not when the request arrives: another one may be on its way.
std::optional<Fault> Session::too_large_with(std::span<const SceneChange> changes) const {
  std::uint64_t vertices = collider_.scene().vertex_count();
  std::uint64_t faces = collider_.scene().face_count();
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const auto* add = std::get_if<AddBody>(&changes[i]);
    if (add == nullptr) continue;
    const std::string where = "changes[" + std::to_string(i) + "]: ";
    vertices += add->addition.body.vertex_count;
    faces += add->addition.faces.size();
    if (vertices > limits_.max_vertices)
      return too_large(where + "vertices of the scene", vertices, limits_.max_vertices, "max-vertices");
    if (faces > limits_.max_triangles)
      return too_large(where + "faces of the scene", faces, limits_.max_triangles, "max-triangles");
  }
  return std::nullopt;
}

std::optional<Fault> Session::apply(std::uint64_t next_frame, std::vector<SceneChange>& changes) {
  if (next_frame != frames_.expected())
    return Fault{ErrorCode::kFailedPrecondition, Reason::kFrameOutOfOrder,
                 "next_frame: " + name_of(next_frame) + " is out of order: frame " +
                     std::to_string(frames_.expected()) + " is expected",
                 frames_.expected()};
  if (std::optional<Fault> fault = too_large_with(changes)) return fault;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (std::optional<Fault> refusal = account_->refusal()) return refusal;
    const auto carry_out = [&]() -> Status {
      if (auto* add = std::get_if<AddBody>(&changes[i])) {
        const Result<std::uint32_t> added =
            collider_.add_body(std::move(add->addition), std::span<const double>(add->positions));
        return added ? Status{} : Status{added.error()};
      }
      auto& change = std::get<ChangeBody>(changes[i]);
      return collider_.change_body(change.index, std::move(change.body));
    };
    const Status status = carry_out();
    {
      const MutexLock lock(mutex_);
      scene_ = std::make_shared<const Scene>(collider_.scene());
    }
    if (!status) return fault_from(status.error(), "changes[" + std::to_string(i) + "]: ");
  }
  return std::nullopt;
}

Outcome<std::shared_ptr<const Answer>> Session::compute(Request& request) {
  const std::uint64_t frame = request.frame;
  const Scene& scene = collider_.scene();
  if (request.pass.cancelled()) return cancelled(frame);
  if (request.pass.refused) return *request.pass.refused;
  switch (frames_.classify(frame)) {
    case FrameSequence::Verdict::kOutOfOrder:
      return Fault{
          ErrorCode::kFailedPrecondition, Reason::kFrameOutOfOrder,
          name_of(frame) + " is out of order: frame " + std::to_string(frames_.expected()) + " is expected",
          frames_.expected()};
    case FrameSequence::Verdict::kRepeat:
      // By its bytes alone: the scene may have changed since they made a frame of it.
      if (!(request.contents == *last_frame_))
        return Fault{ErrorCode::kAborted, Reason::kFrameChanged,
                     name_of(frame) +
                         " was already answered for other positions; number frames upwards, frame " +
                         std::to_string(frames_.expected()) + " is next",
                     frames_.expected()};
      return last_answer_;
    case FrameSequence::Verdict::kNext:
      break;
  }
  if (Status complete = request.contents.complete(scene); !complete)
    return fault_from(complete.error(), name_of(frame) + ": ");
  if (std::optional<Fault> refusal = account_->refusal()) {
    refusal->message = name_of(frame) + ": " + refusal->message;
    return *std::move(refusal);
  }
  if (check_is_due()) {
    if (Outcome<std::string> checked = self_check(name_of(frame) + ": "); !checked) return checked.fault();
  }
  const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - request.arrived;
  Result<StepResult> result = collider_.step(request.contents.view(), request.pass.given_up.get());
  if (!result && result.error().code == ErrorCode::kCancelled) return cancelled(frame);
  if (!result) return fault_from(result.error(), name_of(frame) + ": ");
  Answer answer = make_answer(frame, scene, result.value(), options_.fields);
  answer.queue_ms = 1e3 * waited.count();
  if (answer.all_deformable) {
    answer.all_deformable->frame_bytes = request.contents.bytes();
    answer.all_deformable->positions_bytes = std::size_t{3} * scene.vertex_count() * size_of(dtype_);
  }
  answer.memory = Holding(account_, answer.memory_bytes());
  last_answer_ = std::make_shared<const Answer>(std::move(answer));
  last_frame_ = std::move(request.contents);
  frames_.advance();
  ++steps_unchecked_;
  if (metrics_ != nullptr)
    metrics_->step_done(last_answer_->statistics, last_answer_->vf + last_answer_->ee, waited.count());
  stepped_ = true;
  return last_answer_;
}

Outcome<Session::Attachment> Session::attach(bool takeover, Evict evict, AttachDone done) {
  Evict evicted;
  Attachment attachment{};
  {
    const MutexLock lock(mutex_);
    if (closed_) return *closed_;
    if (attachment_ && !takeover)
      return Fault{
          ErrorCode::kAborted, Reason::kSessionAttached,
          "session " + id_.text() + " is held by another stream; detach that one, or attach with takeover"};
    evicted = std::exchange(evict_, std::move(evict));
    attachment = Attachment{++attachments_};
    attachment_ = attachment;
    last_request_ = std::chrono::steady_clock::now();
  }
  if (evicted)
    evicted({ErrorCode::kAborted, Reason::kSessionAttached,
             "session " + id_.text() + " was taken over by another stream"});
  mailbox_->post_always([self = shared_from_this(), done = std::move(done)] {
    if (std::optional<Fault> fault = self->closed()) return done(*std::move(fault));
    done(self->frames_.expected());
  });
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
  Evict evict;
  {
    const MutexLock lock(mutex_);
    if (closed_) return;
    closed_ = fault;
    evict.swap(evict_);
  }
  if (evict) evict(fault);
}

}  // namespace warmfront::server
