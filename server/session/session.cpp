// SPDX-License-Identifier: Apache-2.0
// Stepping a session by its frame rule. Thread safety as stated in the header.
#include "server/session/session.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <exception>
#include <new>
#include <utility>

#include "engine/stop.h"
#include "server/session/step_cost.h"

namespace warmfront::server {
namespace {

Fault engine_failed(const char* what, const char* why) noexcept {
  const auto fault = [](std::string message) {
    return Fault{ErrorCode::kInternal, Reason::kEngine, std::move(message)};
  };
  try {
    return fault(std::string(what) + ": the engine failed: " + why);
  } catch (...) {
    return fault("engine failed");
  }
}

std::string name_of(std::uint64_t frame) {
  return "frame " + std::to_string(frame);
}

constexpr const char* kMaxMessageBytes = "max-message-bytes";

/// Of an answer that is longer than who asks can be told.
Error too_long(std::size_t bytes) {
  return {ErrorCode::kResourceExhausted,
          "its answer has " + std::to_string(bytes) +
              " bytes of contacts, which do not fit into one message; send the frame over StreamSteps, which "
              "answers in parts, or raise --max-message-bytes"};
}

/// Tells a change from a frame, which begins with 0 or 1.
constexpr std::uint64_t kChange = 2;
/// And a commit.
constexpr std::uint64_t kCommit = 3;

/// Of what a session is created from.
std::uint64_t digest_of(const SessionSpec& spec, const PositionBuffer& positions) {
  StateDigest digest(spec.header_digest);
  digest.add(std::span(spec.scene.faces));
  digest.add(positions.bytes());
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

std::string text_of(const SessionState& state) {
  return name_of(state.frame) + ", revision " + std::to_string(state.revision);
}

}  // namespace

class Session::Running {
 public:
  /// `given_up` is by the client; it may be null.
  Running(Session& session, std::atomic<bool>* given_up)
      : session_(session), stop_(given_up != nullptr ? *given_up : session.stop_) {
    const MutexLock lock(session_.mutex_);
    session_.running_ = &stop_;
    if (session_.closed_) stop_ = true;
  }
  ~Running() {
    const MutexLock lock(session_.mutex_);
    session_.running_ = nullptr;
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  const std::atomic<bool>* stop() const { return &stop_; }

 private:
  Session& session_;
  std::atomic<bool>& stop_;
};

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
        Collider::create(shared, positions.view(), spec.options, std::move(host.workers), host.given_up);
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
      limits_(host.limits),
      tenant_(std::move(host.tenant)),
      mailbox_(std::make_shared<Mailbox>(
          host.runner, host.limits.window, lane_of(step_cost_ms(scene->element_count(), {})),
          tenant_ ? std::shared_ptr<Share>(tenant_, &tenant_->share) : std::shared_ptr<Share>())),
      account_(std::move(host.account)),
      companion_(std::move(host.companion)),
      collider_(std::move(collider)),
      memory_(account_, collider_.memory_bytes()),
      frames_(spec.first_frame),
      standing_{{spec.first_frame, spec.first_revision, digest}, std::nullopt},
      next_ms_(step_cost_ms(scene->element_count(), {})),
      scene_(std::move(scene)),
      options_(collider_.options()),
      last_request_(std::chrono::steady_clock::now()) {
  snapshot_.state = standing_.now;
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

void Session::step(std::uint64_t frame, FrameBuffer contents, AdmittedFrame pass, Admission admission,
                   StepDone done, Before before, Question question) {
  pass.hold(contents.memory_bytes());
  // Shared, because a std::function must be copyable and the reply is used by whichever of the two paths is
  // taken.
  take(std::make_shared<Request>(Request{frame, Asked{std::move(contents), std::move(question)},
                                         std::move(pass), std::move(done), std::move(before)}),
       admission);
}

void Session::commit(std::uint64_t frame, double fraction, AdmittedFrame pass, StepDone done, Before before) {
  take(std::make_shared<Request>(
           Request{frame, Committed{fraction}, std::move(pass), std::move(done), std::move(before)}),
       Admission::kAlways);
}

void Session::take(const std::shared_ptr<Request>& request, Admission admission) {
  Mailbox::Job job = [in_hand = in_hand(), request] {
    Outcome<std::shared_ptr<const Answer>> outcome = (*in_hand)->compute_guarded(*request);
    // The frame is computed: what it held is free before its client hears of it.
    request->pass.give_back();
    request->done(std::move(outcome));
  };
  if (admission == Admission::kAlways) {
    mailbox_->run_or_post(std::move(job));
  } else if (!mailbox_->post(std::move(job), Mailbox::Kind::kStep)) {
    request->done(limit_met(
        name_of(request->frame) + ": too many frames of this session wait; send it again after an answer",
        "window", true));
  }
}

void Session::change(ChangeOrder order, ChangeDone done, Before before) {
  auto shared = std::make_shared<ChangeOrder>(std::move(order));
  auto reply = std::make_shared<ChangeDone>(std::move(done));
  const bool posted = mailbox_->post([in_hand = in_hand(), shared, reply, before = std::move(before)] {
    const Outcome<SessionState> outcome = (*in_hand)->guarded<SessionState>(
        "changing the scene", [&] { return (*in_hand)->apply(*shared, before); });
    // What the changes held is free before their client hears of them.
    shared->give_back();
    (*reply)(outcome);
  });
  if (posted) return;
  shared->give_back();
  (*reply)(limit_met("ChangeScene: too many frames of this session wait; try again after an answer", "window",
                     true));
}

template <class T, class Work>
Outcome<T> Session::guarded(const char* what, Work work) noexcept {
  stepped_ = false;
  const auto began = std::chrono::steady_clock::now();
  Outcome<T> outcome = [&]() -> Outcome<T> {
    try {
      if (std::optional<Fault> fault = closed()) return *std::move(fault);
      std::optional<Workers::OneThread> one_thread;
      if (runner_.takes_one_thread(lane_of(next_ms_))) one_thread.emplace();
      return work();
    } catch (const std::bad_alloc&) {
      return no_memory(what);
    } catch (const std::exception& error) {
      return engine_failed(what, error.what());
    }
  }();
  if (!outcome && outcome.fault().engine_failed()) {
    close_as("was dropped after a failure of the engine");
    lost_(*this, outcome.fault());
    return outcome;
  }
  took_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
  take_stock();
  return outcome;
}

void Session::take_stock() {
  const auto* asked = last_frame_ ? std::get_if<Asked>(&*last_frame_) : nullptr;
  memory_.set(collider_.memory_bytes() + (asked != nullptr ? asked->contents.memory_bytes() : 0));
  plan_next();
  const MutexLock lock(mutex_);
  snapshot_.state = standing_.now;
  snapshot_.steps = frames_.steps();
  last_request_ = std::chrono::steady_clock::now();
}

// Only what follows a step is foreseen to be brief: the first of a changed scene, or of one whose warmth is
// gone, may take long, and so may the frame again that was given up. A check takes a time of its own.
void Session::plan_next() {
  const std::uint64_t elements = collider_.scene().element_count();
  next_ms_ = step_cost_ms(elements, last_counts_);
  if (last_counts_beside_) next_ms_ += step_cost_ms(elements, *last_counts_beside_);
  // A request that took many times what was foreseen, and more than waiting for others explains, was one of
  // the long ones, whatever counts it has to show: a step that was given up has none.
  constexpr double kOutgrown = 10, kLeastMs = 100;
  const bool outgrown = took_ms_ > std::max(kLeastMs, kOutgrown * next_ms_);
  if (outgrown) next_ms_ = took_ms_;
  const bool foreseen = stepped_ && !outgrown && !check_is_due();
  mailbox_->foresee(lane_of(next_ms_), foreseen ? next_ms_ : Mailbox::kUnforeseen);
}

bool Session::check_is_due() const {
  return limits_.self_check_steps > 0 && steps_unchecked_ >= limits_.self_check_steps;
}

Outcome<std::shared_ptr<const Answer>> Session::compute_guarded(Request& request) noexcept {
  std::array<char, 32> name{};  // where no memory is needed
  static_cast<void>(
      std::snprintf(name.data(), name.size(), "frame %llu", static_cast<unsigned long long>(request.frame)));
  auto outcome = guarded<std::shared_ptr<const Answer>>(name.data(), [&] {
    if (request.before) request.before();
    return compute(request);
  });
  // A motion that failed is followed by no commit of the one before it; a question about a state leaves that
  // as it is, as Collider does.
  const auto* asked = std::get_if<Asked>(&request.content);
  if (!outcome && asked != nullptr && !asked->question.of_state()) trial_.reset();
  return outcome;
}

void Session::check(CheckDone done, std::shared_ptr<std::atomic<bool>> given_up) {
  auto reply = std::make_shared<CheckDone>(std::move(done));
  const bool posted = mailbox_->post([in_hand = in_hand(), reply, given_up = std::move(given_up)] {
    Session& self = *in_hand->operator->();
    (*reply)(self.guarded<std::string>("the self-check", [&] {
      const Running running(self, given_up.get());
      return self.self_check("", running.stop());
    }));
  });
  if (!posted)
    (*reply)(limit_met("CheckSession: too many frames of this session wait; try again after an answer",
                       "window", true));
}

Fault Session::given_up(const std::string& what) const {
  if (std::optional<Fault> fault = closed()) return *std::move(fault);
  return {ErrorCode::kCancelled, Reason::kCancelled,
          what + ": given up by its client; the session is as before it"};
}

Outcome<std::string> Session::self_check(const std::string& where, const std::atomic<bool>* stop) {
  const Status sound = collider_.self_check(stop);
  if (!sound && sound.error().code == ErrorCode::kCancelled)
    return given_up(where.empty() ? "CheckSession" : where.substr(0, where.find(':')));
  steps_unchecked_ = 0;
  const bool lost = !sound && (sound.error().code == ErrorCode::kDataLoss || was_rebuilt_);
  using Check = SessionObserver::Check;
  if (observer_ != nullptr)
    observer_->self_checked(sound ? Check::kPassed : lost ? Check::kDataLost : Check::kRebuilt);
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

// Here and not when the request arrives: another one may be on its way. How long filters are follows from the
// scene's vertices, which the collider checks, but for their pairs, which are bounded by what a session may
// hold.
std::optional<Fault> Session::too_large_with(std::span<const SceneChange> changes) const {
  const Scene& scene = collider_.scene();
  const std::span<const Body> bodies = scene.bodies();
  struct Size {
    std::uint64_t vertices = 0, elements = 0;
  };
  Size all{scene.vertex_count(), scene.element_count()};
  std::vector<Size> of_body;  // once some is replaced
  std::vector<Size> added;    // before that
  const auto count_bodies = [&] {
    if (!of_body.empty() || bodies.empty()) return;
    for (const Body& body : bodies) of_body.push_back({body.vertex_count, 0});
    of_body.insert(of_body.end(), added.begin(), added.end());
    for (const Face& face : scene.faces()) ++of_body[scene.body_of_vertex()[face[0]]].elements;
    for (const std::uint32_t e : scene.lone_edges())
      ++of_body[scene.body_of_vertex()[scene.edges()[e][0]]].elements;
  };
  // Without declared bodies only all of it is replaced.
  const auto replace = [&](std::uint32_t index, std::optional<std::uint64_t> vertices,
                           std::uint64_t elements) {
    count_bodies();
    if (bodies.empty()) {
      all.elements = elements;
    } else if (index < of_body.size()) {
      Size& size = of_body[index];
      const Size with{vertices.value_or(size.vertices), elements};
      all = {all.vertices - size.vertices + with.vertices, all.elements - size.elements + with.elements};
      size = with;
    }
  };
  const auto elements_of = [](const auto& of) { return of.faces.size() + of.edges.size(); };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (const auto* elements = std::get_if<ReplaceElements>(&changes[i])) {
      replace(elements->index, std::nullopt, elements_of(*elements));
    } else if (const auto* body = std::get_if<ReplaceBody>(&changes[i])) {
      replace(body->index, body->addition.body.vertex_count, elements_of(body->addition));
    } else if (const auto* add = std::get_if<AddBody>(&changes[i])) {
      const Size size{add->addition.body.vertex_count, elements_of(add->addition)};
      (of_body.empty() ? added : of_body).push_back(size);
      all = {all.vertices + size.vertices, all.elements + size.elements};
    } else {
      continue;
    }
    const std::string where = "changes[" + std::to_string(i) + "]: ";
    if (all.vertices > limits_.max_vertices)
      return too_large(where + "vertices of the scene", all.vertices, limits_.max_vertices, "max-vertices");
    if (all.elements > limits_.max_triangles)
      return too_large(where + "faces and lone edges of the scene", all.elements, limits_.max_triangles,
                       "max-triangles");
  }
  return std::nullopt;
}

std::size_t Session::growth_with(std::span<const SceneChange> changes) const {
  const std::uint64_t vertices = collider_.scene().vertex_count();
  const std::uint64_t elements = collider_.scene().element_count();
  std::uint64_t more_vertices = 0, more_elements = 0;
  const PairFilters* other = nullptr;  // in place of the scene's
  const bool is_thick = collider_.scene().most_thickness() > 0;
  bool becomes_thick = is_thick;
  bool replaces = false;
  const auto grow_by = [&](const BodyAddition& body) {
    becomes_thick |= body.body.thickness > 0 || !body.thickness.empty();
    more_vertices += body.body.vertex_count;
    if (body.body.half_space) more_vertices += kVerticesPerHalfSpace;
    more_elements += body.faces.size() + body.edges.size();
  };
  for (const SceneChange& change : changes) {
    if (const auto* body = std::get_if<ChangeBody>(&change)) becomes_thick |= body->body.thickness > 0;
    if (const auto* filters = std::get_if<ChangeFilters>(&change)) other = &filters->filters;
    if (const auto* add = std::get_if<AddBody>(&change)) grow_by(add->addition);
    if (const auto* elements_of = std::get_if<ReplaceElements>(&change)) {
      replaces = true;
      more_elements += elements_of->faces.size() + elements_of->edges.size();
    }
    if (const auto* body = std::get_if<ReplaceBody>(&change)) {
      replaces = true;
      grow_by(body->addition);
    }
  }
  const auto estimate = [&](std::uint64_t v, std::uint64_t e, bool thick) {
    return estimate_bytes(v, e, size_of(dtype_), collider_.options().explain, thick, limits_);
  };
  const auto of_filters = [&](const PairFilters& filters, std::uint64_t v) {
    return estimate_filter_bytes(FilterSize::of(filters), v, collider_.options().explain);
  };
  // Other filters are made beside those that there are; these grow with the bodies that are added.
  const PairFilters& present = collider_.scene().filters();
  const std::size_t more_filters =
      other != nullptr ? of_filters(*other, vertices + more_vertices)
                       : of_filters(present, vertices + more_vertices) - of_filters(present, vertices);
  // The scene, and the same in the order of the hierarchies, are made beside what is there, and a list that
  // grows is copied; without declared bodies all is.
  constexpr std::size_t kBesideAVertex = 200, kBesideAnElement = 320;
  const std::size_t beside = !replaces ? 0
                             : collider_.scene().bodies().empty()
                                 ? estimate(vertices, elements, is_thick)
                                 : kBesideAVertex * vertices + kBesideAnElement * elements;
  return estimate(vertices + more_vertices, elements + more_elements, becomes_thick) -
         estimate(vertices, elements, is_thick) + more_filters + beside;
}

Fault Session::with_removed(Fault refusal) const {
  const Scene& scene = collider_.scene();
  const std::span<const Body> bodies = scene.bodies();
  std::uint64_t count = 0, vertices = 0, faces = 0;
  for (const Body& body : bodies) {
    if (body.kind != BodyKind::kRemoved) continue;
    ++count;
    vertices += body.vertex_count;
  }
  if (count == 0) return refusal;
  for (const Face& face : scene.faces())
    faces += bodies[scene.body_of_vertex()[face[0]]].kind == BodyKind::kRemoved;
  constexpr std::uint64_t kGoodPart = 4;  // one of so many
  if (kGoodPart * vertices <= scene.vertex_count() && kGoodPart * faces <= scene.face_count()) return refusal;
  refusal.message +=
      "; " + std::to_string(vertices) + " of its " + std::to_string(scene.vertex_count()) + " vertices and " +
      std::to_string(faces) + " of its " + std::to_string(scene.face_count()) + " faces are of " +
      std::to_string(count) +
      " removed bodies, which are kept: replacing these by removed bodies without vertices, or "
      "creating the session again without them, frees them";
  return refusal;
}

std::optional<Fault> Session::refusal_of(const ChangeOrder& order) const {
  if (order.expected && *order.expected != standing_.now)
    return Fault{ErrorCode::kAborted, Reason::kStateChanged,
                 "expected_state: the session is not in this state (" + text_of(*order.expected) +
                     ") but in another (" + text_of(standing_.now) +
                     "): another copy was changed or stepped meanwhile; attach to see",
                 frames_.expected()};
  if (order.next_frame != frames_.expected())
    return Fault{ErrorCode::kFailedPrecondition, Reason::kFrameOutOfOrder,
                 "next_frame: " + name_of(order.next_frame) + " is out of order: frame " +
                     std::to_string(frames_.expected()) + " is expected",
                 frames_.expected()};
  if (std::optional<Fault> fault = too_large_with(order.changes)) return with_removed(*std::move(fault));
  if (std::optional<Fault> refusal = account_->refusal(more_with(order)))
    return with_removed(*std::move(refusal));
  return std::nullopt;
}

// What is estimated for the growth covers the changes as they wait, too.
std::size_t Session::more_with(const ChangeOrder& order) const {
  const std::size_t growth = growth_with(order.changes);
  return growth - std::min(growth, order.memory.bytes());
}

Outcome<SessionState> Session::apply(ChangeOrder& order, const Before& before) {
  if (!order.key.empty() && done_order_ && order.key == done_order_->key) {
    if (order.digest == done_order_->digest) return done_order_->state;
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 "key: other changes were carried out under this one; choose another for each request"};
  }
  trial_.reset();
  if (before) before();
  const Running running(*this, order.given_up.get());
  if (std::optional<Fault> refusal = refusal_of(order)) return *std::move(refusal);
  // Charged before it grows, so that others who ask meanwhile see it; take_stock() knows what it became.
  const Holding growth(account_, more_with(order));
  std::size_t failed = 0;
  const std::size_t count = order.changes.size();
  if (Status status = collider_.change(std::move(order.changes), running.stop(), &failed, order.options);
      !status) {
    if (status.error().code == ErrorCode::kCancelled) return given_up("ChangeScene");
    return fault_from(status.error(),
                      failed < count ? "changes[" + std::to_string(failed) + "]: " : "options.",
                      kAdjacentFaces);
  }
  std::shared_ptr<const Scene> scene = collider_.shared_scene();  // nothing after the changes may fail
  StateDigest digest(standing_.now.digest);
  digest.add(kChange);
  digest.add(order.digest);
  advance({standing_.now.frame, standing_.now.revision + 1, digest.value()});
  done_order_.reset();
  if (!order.key.empty()) done_order_ = {std::move(order.key), order.digest, standing_.now};
  const MutexLock lock(mutex_);
  scene_ = std::move(scene);
  options_ = collider_.options();
  return standing_.now;
}

Fault Session::taken_over() const {
  return {ErrorCode::kAborted, Reason::kSessionAttached,
          "session " + id_.text() + " was taken over by another stream"};
}

Fault Session::out_of_order(std::uint64_t frame) const {
  return {ErrorCode::kFailedPrecondition, Reason::kFrameOutOfOrder,
          name_of(frame) + " is out of order: frame " + std::to_string(frames_.expected()) + " is expected",
          frames_.expected()};
}

Outcome<std::shared_ptr<const Answer>> Session::compute(Request& request) {
  const std::uint64_t frame = request.frame;
  if (request.pass.cancelled()) return given_up(name_of(frame));
  if (request.pass.refused) return *request.pass.refused;
  if (request.pass.attachment && *request.pass.attachment < holder_) return taken_over();
  auto* asked = std::get_if<Asked>(&request.content);
  const bool counts = asked == nullptr || asked->question.counts();
  switch (frames_.classify(frame)) {
    case FrameSequence::Verdict::kOutOfOrder:
      return out_of_order(frame);
    case FrameSequence::Verdict::kRepeat:
      return counts ? repeated(request) : out_of_order(frame);
    case FrameSequence::Verdict::kNext:
      break;
  }
  return asked != nullptr ? ask(request, *asked) : take_trial(request, std::get<Committed>(request.content));
}

Outcome<std::shared_ptr<const Answer>> Session::repeated(const Request& request) const {
  // By its bytes alone: the scene may have changed since they made a frame of it.
  if (!(request.content == *last_frame_))
    return Fault{ErrorCode::kAborted, Reason::kFrameChanged,
                 name_of(request.frame) +
                     " was already answered for other content; number frames upwards, frame " +
                     std::to_string(frames_.expected()) + " is next",
                 frames_.expected()};
  if (last_answer_->contact_bytes() > request.pass.max_answer_bytes)
    return fault_from(too_long(last_answer_->contact_bytes()), name_of(request.frame) + " is answered, but ",
                      kMaxMessageBytes);
  return last_answer_;
}

Outcome<Question> Session::within_limits(Question question) const {
  const QuestionOptions& options = question.options;
  const auto invalid = [](std::string message) {
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput, std::move(message)};
  };
  if (options.max_contacts && *options.max_contacts > collider_.options().max_contacts)
    return invalid("question.max_contacts: " + std::to_string(*options.max_contacts) +
                   " is above the session's " + std::to_string(collider_.options().max_contacts));
  const ColliderOptions asked = merged(collider_.options(), question);
  if (Status valid = validate(asked); !valid) return fault_from(valid.error(), "question.");
  // With more fields than the session's, or what reducing takes, fewer contacts have room.
  if (options.fields || options.reduced)
    question.options.max_contacts = std::min(
        asked.max_contacts,
        most_contacts(limits_.max_session_bytes, collider_.options().explain, asked.fields, options.reduced));
  return question;
}

Outcome<std::shared_ptr<const Answer>> Session::ask(Request& request, Asked& asked) {
  const std::uint64_t frame = request.frame;
  const Scene& scene = collider_.scene();
  FrameBuffer& contents = asked.contents;
  const Outcome<Question> question = within_limits(asked.question);
  if (!question) {
    Fault fault = question.fault();
    fault.message = name_of(frame) + ": " + fault.message;
    return fault;
  }
  // The collider may have an older one, where a later one failed before it came there.
  if (asked.question.where == Where::kTrialEnd && !trial_)
    return Fault{ErrorCode::kFailedPrecondition, Reason::kInvalidInput,
                 name_of(frame) +
                     ": question.where: no trial of this frame was answered since the last frame or change of the "
                     "scene, or a motion failed since; send the trial again"};
  const bool counts = asked.question.counts();
  const ContactFields fields = merged(collider_.options(), question.value()).fields;
  if (Status complete = contents.complete(scene); !complete)
    return fault_from(complete.error(), name_of(frame) + ": ");
  request.pass.hold(contents.memory_bytes());
  if (std::optional<Fault> refusal = account_->refusal()) {
    refusal->message = name_of(frame) + ": " + refusal->message;
    return with_removed(*std::move(refusal));
  }
  if (check_is_due()) {
    const Running running(*this, request.pass.given_up.get());
    if (Outcome<std::string> checked = self_check(name_of(frame) + ": ", running.stop()); !checked)
      return checked.fault();
  }
  const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - request.arrived;
  StateDigest digest(standing_.now.digest);
  contents.add_to(digest);
  // Made before the step is taken: where there is no memory for it, or nobody could be told, the frame did
  // not happen. What follows the step cannot fail.
  std::shared_ptr<Answer> answer;
  const char* limit = kMaxContacts;
  const auto accept = [&](const StepResult& step) -> Status {
    const std::size_t bytes = contact_bytes(step, fields);
    if (bytes > request.pass.max_answer_bytes) {
      limit = kMaxMessageBytes;
      return too_long(bytes);
    }
    answer = std::make_shared<Answer>(make_answer(frame, scene, step, fields));
    return {};
  };
  const Result<StepResult> result = [&] {
    const Running running(*this, request.pass.given_up.get());
    return collider_.ask(contents.view(), question.value(), running.stop(), accept);
  }();
  if (!result && result.error().code == ErrorCode::kCancelled) return given_up(name_of(frame));
  if (!result) return fault_from(result.error(), name_of(frame) + ": ", limit);
  answer->statistics = result.value().statistics;
  answer->queue_ms = 1e3 * waited.count();
  answer->keep_distance = question.value().options.keep_distance;
  last_counts_ = answer->statistics.counts;
  last_counts_beside_.reset();
  if (result.value().all_deformable) {
    answer->all_deformable.emplace(
        Answer::AllDeformable{*result.value().all_deformable, contents.bytes(),
                              std::size_t{3} * scene.vertex_count() * size_of(dtype_)});
    last_counts_beside_ = answer->all_deformable->statistics.counts;
  }
  answer->memory = Holding(account_, answer->memory_bytes());
  answer->state_before = standing_.now;
  ++steps_unchecked_;
  if (observer_ != nullptr) observer_->step_done(answer->statistics, answer->pairs(), waited.count());
  stepped_ = asked.question.kind != QuestionKind::kPlace;  // what comes next builds what that dropped
  if (!counts) {
    answer->state = standing_.now;
    if (!asked.question.of_state()) trial_ = digest.value();
    return std::shared_ptr<const Answer>(std::move(answer));
  }
  answer->state = {frame, standing_.now.revision, digest.value()};
  finish_frame(std::move(answer), std::move(asked));
  return last_answer_;
}

Outcome<std::shared_ptr<const Answer>> Session::take_trial(const Request& request, Committed committed) {
  const std::string name = name_of(request.frame);
  const double fraction = committed.fraction;
  const bool is_fraction = fraction >= 0 && fraction <= 1;  // what is none is for the collider to refuse
  if (is_fraction && !trial_)
    return Fault{
        ErrorCode::kFailedPrecondition, Reason::kInvalidInput,
        name +
            ": no trial of this frame was answered since the last frame or change of the scene, or a "
            "motion failed since; send the trial again, then the commit"};
  auto answer = std::make_shared<Answer>();
  const Result<CommitResult> result =
      collider_.commit(fraction, dtype_ == Dtype::kFloat32 ? Rounding::kFloat32 : Rounding::kFloat64);
  if (!result) return fault_from(result.error(), name + ": ");
  StateDigest digest(standing_.now.digest);
  digest.add(kCommit);
  digest.add(*trial_);
  digest.add(std::bit_cast<std::uint64_t>(fraction == 0 ? 0.0 : fraction));
  answer->frame = request.frame;
  answer->vf = result.value().vf.value_or(0);
  answer->ee = result.value().ee.value_or(0);
  answer->vh = result.value().vh.value_or(0);
  answer->possible = result.value().possible.value_or(0);
  answer->commit_counted = result.value().vf.has_value();
  answer->earliest_toi = result.value().earliest_toi;
  answer->state = {request.frame, standing_.now.revision, digest.value()};
  answer->state_before = standing_.now;
  stepped_ = true;
  finish_frame(std::move(answer), committed);
  return last_answer_;
}

void Session::finish_frame(std::shared_ptr<const Answer> answer, Content content) noexcept {
  last_answer_ = std::move(answer);
  last_frame_ = std::move(content);
  trial_.reset();
  frames_.advance();
  advance(last_answer_->state);
}

Outcome<Session::Attachment> Session::attach(bool takeover, Evict evict, AttachDone done) {
  // All that may throw comes first: a stream that is not told of its attachment could never give it back.
  const auto number = std::make_shared<Attachment>();
  Mailbox::Entry entry = mailbox_->prepare([self = shared_from_this(), number, done = std::move(done)] {
    self->holder_ = std::max(self->holder_, *number);
    try {
      if (std::optional<Fault> fault = self->closed()) return done(*std::move(fault));
      done(self->standing_);
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
    if (attachment_ && !takeover)
      return Fault{
          ErrorCode::kAborted, Reason::kSessionAttached,
          "session " + id_.text() + " is held by another stream; detach that one, or attach with takeover"};
    evicted = std::exchange(evict_, std::move(evict));
    attachment = *number = Attachment{++attachments_};
    attachment_ = attachment;
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
