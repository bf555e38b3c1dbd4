// SPDX-License-Identifier: Apache-2.0
// A session: a collider kept warm, what it has carried out, and the stream that holds it.
// Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "server/annotations.h"
#include "server/fault.h"
#include "server/session/account.h"
#include "server/session/admitted_frame.h"
#include "server/session/change_order.h"
#include "server/session/history.h"
#include "server/session/id.h"
#include "server/session/limits.h"
#include "server/session/mailbox.h"
#include "server/session/observer.h"
#include "server/session/spare_positions.h"
#include "server/session/step_forecast.h"
#include "server/session/tenants.h"

namespace warmfront::server {

/// What a client says of a session.
struct SessionSpec {
  SessionId id;
  SceneDescription scene;
  ColliderOptions options;
  Dtype dtype = Dtype::kFloat64;
  std::uint64_t first_frame = 0;
  std::vector<BodyPose> poses;  ///< at first_frame, of the rigid bodies that are not at rest
  std::uint64_t first_revision = 0;
  /// A hash of what the client says besides faces and positions: where it differs, so do states.
  std::uint64_t header_digest = 0;
};

/// A session as it stands; see SessionInfo on the wire.
struct SessionSnapshot {
  SessionState state;
  std::uint64_t steps = 0;
  std::size_t memory_bytes = 0;
  bool attached = false;
  bool in_hand = false;  ///< a request waits or is carried out
  std::chrono::system_clock::time_point created;
  std::chrono::milliseconds idle{0};  ///< since the last request; 0 while one waits or is carried out
};

class Session : public std::enable_shared_from_this<Session> {
 public:
  using CheckDone = std::function<void(const Outcome<std::string>&)>;
  using AttachDone = std::function<void(const Outcome<Standing>&)>;
  /// Told once, on a thread that runs its jobs, when the engine failed and the session must be forgotten.
  using Lost = std::function<void(Session&, const Fault&)>;
  /// Told, on a thread that runs its jobs, when a self-check found something and it is made anew.
  using Rebuilt = std::function<void(const Session&, const std::string& found)>;
  using Attachment = server::Attachment;
  /// Tells a stream to end with this fault, after the frames that it has in flight.
  using Evict = std::function<void(const Fault&)>;

  /// Where a session lives.
  struct Host {
    std::shared_ptr<Workers> workers;
    Runner& runner;                    ///< outlives the session
    const Limits& limits;              ///< outlive the session
    std::shared_ptr<Account> account;  ///< what the session holds is charged to it
    Lost lost;
    std::string owner = {};               ///< the principal that makes it, ...
    std::shared_ptr<Tenant> tenant = {};  ///< ... and what that may have; null: as much as there is
    SessionObserver* observer = nullptr;  ///< told of its steps, if anybody is; outlives the session
    std::shared_ptr<SessionCompanion> companion = {};  ///< kept for as long as the session; may be null
    Rebuilt rebuilt = {};                              ///< if anybody wants to know
    const std::atomic<bool>* given_up = nullptr;       ///< stops the making of it, CANCELLED
  };
  /// Builds the hierarchy: slow, so call it on the runner. Fails as Scene::create() and Collider::create()
  /// do; RESOURCE_EXHAUSTED when memory runs out.
  static Outcome<std::shared_ptr<Session>> create(SessionSpec spec, const PositionBuffer& positions,
                                                  Host host);

  const SessionId& id() const { return id_; }
  const std::string& owner() const { return owner_; }
  /// Null where nobody said.
  Tenant* tenant() const { return tenant_.get(); }
  Dtype dtype() const { return dtype_; }
  /// Of what a commit makes.
  Rounding rounding() const { return dtype_ == Dtype::kFloat32 ? Rounding::kFloat32 : Rounding::kFloat64; }
  /// As it is now.
  std::shared_ptr<const Scene> scene() const;
  ColliderOptions options() const;
  const std::shared_ptr<Account>& account() const { return account_; }
  const std::shared_ptr<SessionCompanion>& companion() const { return companion_; }
  /// Memory for a frame's positions; thread-safe.
  SparePositions& spare_positions() { return spare_; }
  SessionSnapshot snapshot() const;
  /// Somebody asks about this session: it is used.
  void touch();
  /// Whether anyone has attached to it or stepped it.
  bool used() const;

  /// Whether a frame may be refused because too many wait.
  enum class Admission {
    kBounded,  ///< at most the mailbox's capacity may wait
    kAlways,   ///< for callers that bound their frames themselves
    kHere,     ///< the same, and the caller's thread has time for a short step (Mailbox::Here::kShort)
  };

  /// A frame is about to be submitted with kHere by the calling thread, which has its positions to copy
  /// before: threads that will help in a step of some length wake up meanwhile.
  void expect_step() const noexcept;
  /// Carries the frame out by the rule of step.proto: a step, another question, or a commit. Its observer is
  /// told the answer exactly once: on a runner's thread, or before this returns: for a frame that is refused
  /// with RESOURCE_EXHAUSTED, and for a brief step (step_cost.h) with kAlways, which the calling thread
  /// takes, and those that wait by then and are brief together with it, while the runner has room for guests.
  ///
  /// INVALID_ARGUMENT for a next frame that is not complete, and for a question whose options are out of
  /// range, or above the session's max_contacts. A frame whose client gives up is left undone, CANCELLED: the
  /// session is then as it was before it. ABORTED for a frame of a stream that was taken over, once the one
  /// that took over has been told where the session stands. A trial of the next frame is answered in the same
  /// way and leaves the session where it is.
  ///
  /// A commit makes the frame of the last trial, up to its fraction of the way, as Collider::commit() does:
  /// the same fraction is answered again, another one is ABORTED. FAILED_PRECONDITION where no trial was
  /// answered since the last frame or change, or where a motion failed since.
  void submit(AdmittedFrame frame, Admission admission);

  /// Carries out the changes in order, all of them or none: FAILED_PRECONDITION unless `next_frame` is the
  /// frame expected then, ABORTED unless the session is in the state `expected`. With the key of the last
  /// order that was carried out the answer to that is given again; INVALID_ARGUMENT when its changes were
  /// others. CANCELLED, with nothing changed, when the client gives up before all of them are carried out.
  /// RESOURCE_EXHAUSTED, before this returns, where too many frames wait.
  void change(ChangeOrder order, std::unique_ptr<ChangeObserver> observer);

  /// Checks, in its turn, what the collider keeps, as step() does by itself every limits.self_check_steps:
  /// what was found broken, which is made anew in the next step, or nothing; DATA_LOSS, and the session is
  /// dropped, where that is not possible, or the second time. `done` is called once, as an observer is in
  /// change().
  void check(CheckDone done, std::shared_ptr<std::atomic<bool>> given_up = nullptr);

  /// Who attaches.
  struct Claim {
    bool takeover = false;       ///< evicts the stream that holds the session
    std::string client_id = {};  ///< empty: not said
    std::uint64_t attempt = 0;   ///< grows with each attach of that client
  };
  /// Makes a stream the session's only one. ABORTED when another holds it, unless the claim takes over, and
  /// for an attempt that comes after a later one of the same client. `done` gets where the session stands, on
  /// a runner's thread, once all earlier frames are done.
  Outcome<Attachment> attach(Claim claim, Evict evict, AttachDone done);
  /// Does nothing when the attachment was taken over.
  void detach(Attachment attachment);

  /// Ends the session: frames that wait get `fault`, and so does the one being computed, which is given up;
  /// the stream is evicted. Only the first call counts.
  void close(Fault fault);
  /// close() as NOT_FOUND, with what became of the session: "expired". Never throws: without memory for the
  /// words it has fewer.
  void close_as(const char* what) noexcept;

 private:
  /// A request counts from its arrival until it is answered: meanwhile the session is not idle.
  class InHand {
   public:
    explicit InHand(std::shared_ptr<Session> session);
    ~InHand();
    InHand(const InHand&) = delete;
    InHand& operator=(const InHand&) = delete;
    Session* operator->() const { return session_.get(); }

   private:
    const std::shared_ptr<Session> session_;
  };
  std::shared_ptr<InHand> in_hand() { return std::make_shared<InHand>(shared_from_this()); }

  Session(SessionSpec&& spec, std::uint64_t digest, std::shared_ptr<const Scene> scene, Collider&& collider,
          Host&& host);

  // Frames, in the order of a frame's way (session_frames.cpp).
  void carry_out(AdmittedFrame& frame) noexcept;
  FrameOutcome compute(AdmittedFrame& frame);
  Fault out_of_order(std::uint64_t frame) const;
  FrameOutcome ask(AdmittedFrame& frame, FrameQuestion& asked);
  /// The question as it is asked of the collider, where it may be: it fits the session and its limits.
  Outcome<Question> ready(AdmittedFrame& frame, FrameQuestion& asked) const;
  /// With the options of the session where it has none; INVALID_ARGUMENT as submit().
  Outcome<Question> within_limits(Question question) const;
  /// What a message that too many contacts were found ends with, where it is memory that allows no more.
  std::string why_no_more_contacts(const ColliderOptions& asked) const;
  Outcome<std::shared_ptr<Answer>> collide(const AdmittedFrame& frame, FrameQuestion& asked,
                                           const Question& question);
  void count(const Answer& answer, double waited_seconds);
  FrameOutcome take_trial(std::uint64_t number, FrameCommit commit);
  FrameOutcome finish(std::shared_ptr<const Answer> answer, FrameContent content) noexcept;

  // Changes (session_changes.cpp).
  void carry_out(ChangeOrder& order, ChangeObserver& observer) noexcept;
  Outcome<SessionState> apply(ChangeOrder& order, ChangeObserver& observer);
  std::optional<Fault> refusal_of(const ChangeOrder& order) const;
  /// What the changes make the session grow by, as far as it is more than the order holds already.
  std::size_t more_with(const ChangeOrder& order) const;

  // Around both (session_turn.h, session_turn.cpp).
  /// Runs work on the collider, which without memory leaves everything as it was; what it throws becomes a
  /// fault, and but for std::bad_alloc the session is lost then.
  template <class T, class Work>
  Outcome<T> guarded(const char* what, Work work) noexcept;
  /// A request that close() can stop, for as long as it lives.
  class Running;
  /// The turn took so long: what the session holds now, and how long the next turn will take.
  void take_stock(std::chrono::steady_clock::duration took);
  bool check_is_due() const;
  Outcome<std::string> self_check(const std::string& where, const std::atomic<bool>* stop);
  /// What a request ends with whose client gave up, or whose session was closed meanwhile.
  Fault given_up(const std::string& what) const;

  Fault taken_over() const;
  std::optional<Fault> closed() const;

  // Constant after construction.
  const SessionId id_;
  const std::string owner_;
  SessionObserver* const observer_;
  const Dtype dtype_;
  const std::chrono::system_clock::time_point created_;
  const Lost lost_;
  const Rebuilt rebuilt_;
  Runner& runner_;
  const std::shared_ptr<Workers> workers_;
  const Limits& limits_;
  const std::shared_ptr<Tenant> tenant_;  // may be null
  const std::shared_ptr<Mailbox> mailbox_;
  const std::shared_ptr<Account> account_;
  const std::shared_ptr<SessionCompanion> companion_;

  SparePositions spare_;

  // Used by jobs of the mailbox only, which run one at a time.
  Collider collider_;
  Holding memory_;  // of the collider
  SessionHistory history_;
  StepForecast forecast_;
  std::uint32_t steps_unchecked_ = 0;
  /// The last stream that was told where the session stands: frames of earlier ones are refused.
  Attachment holder_{};
  bool was_rebuilt_ = false;       // after a self-check
  std::atomic<bool> stop_{false};  // a request whose client cannot give it up

  // Protected by mutex_.
  mutable Mutex mutex_;
  std::shared_ptr<const Scene> scene_ WARMFRONT_GUARDED_BY(mutex_);
  ColliderOptions options_ WARMFRONT_GUARDED_BY(mutex_);
  SessionSnapshot snapshot_ WARMFRONT_GUARDED_BY(mutex_);
  std::chrono::steady_clock::time_point last_request_ WARMFRONT_GUARDED_BY(mutex_);
  std::uint32_t in_hand_ WARMFRONT_GUARDED_BY(mutex_) = 0;  // requests
  std::optional<Fault> closed_ WARMFRONT_GUARDED_BY(mutex_);
  std::atomic<bool>* running_ WARMFRONT_GUARDED_BY(mutex_) = nullptr;  // stops the request under way
  std::uint64_t attachments_ WARMFRONT_GUARDED_BY(mutex_) = 0;
  std::optional<Attachment> attachment_ WARMFRONT_GUARDED_BY(mutex_);
  std::string client_id_ WARMFRONT_GUARDED_BY(mutex_);  // of the last attach, ...
  std::uint64_t attempt_ WARMFRONT_GUARDED_BY(mutex_) = 0;
  Evict evict_ WARMFRONT_GUARDED_BY(mutex_);
};

}  // namespace warmfront::server
