// SPDX-License-Identifier: Apache-2.0
// A session: a collider kept warm, its frame rule, its last answer, and the stream that holds it.
// Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "engine/collider.h"
#include "server/annotations.h"
#include "server/fault.h"
#include "server/session/account.h"
#include "server/session/answer.h"
#include "server/session/frame_buffer.h"
#include "server/session/frame_pass.h"
#include "server/session/frame_sequence.h"
#include "server/session/id.h"
#include "server/session/limits.h"
#include "server/session/mailbox.h"
#include "server/session/observer.h"
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

using warmfront::AddBody;
using warmfront::ChangeBody;
using warmfront::ChangeExcludedPairs;
using warmfront::ChangeFilters;
using warmfront::ReplaceBody;
using warmfront::ReplaceElements;
using warmfront::SceneChange;

/// Changes that are carried out together; see ChangeSceneRequest on the wire.
struct ChangeOrder {
  std::uint64_t next_frame = 0;
  std::vector<SceneChange> changes;
  std::string key = {};                                 ///< empty: none
  std::optional<SessionState> expected = std::nullopt;  ///< none: whatever the session is in
  std::uint64_t digest = 0;                             ///< of the changes as they were sent
  /// Set when the client has given up; null for one that cannot.
  std::shared_ptr<std::atomic<bool>> given_up = nullptr;
  Holding memory = {};  ///< the changes, on the session's account
  std::optional<ColliderOptions> options = std::nullopt;  ///< of the session from then on; none: they stay

  /// The changes are carried out, or never will be.
  void give_back() {
    changes = {};
    memory.set(0);
  }
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
  using StepDone = std::function<void(Outcome<std::shared_ptr<const Answer>>)>;
  /// The state after the changes.
  using ChangeDone = std::function<void(const Outcome<SessionState>&)>;
  using CheckDone = std::function<void(const Outcome<std::string>&)>;
  using AttachDone = std::function<void(const Outcome<Standing>&)>;
  /// Told once, on a thread that runs its jobs, when the engine failed and the session must be forgotten.
  using Lost = std::function<void(Session&, const Fault&)>;
  /// Called, on the thread that does it, just before a request is carried out.
  using Before = std::function<void()>;
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
  /// As it is now.
  std::shared_ptr<const Scene> scene() const;
  ColliderOptions options() const;
  const std::shared_ptr<Account>& account() const { return account_; }
  const std::shared_ptr<SessionCompanion>& companion() const { return companion_; }
  SessionSnapshot snapshot() const;
  /// Somebody asks about this session: it is used.
  void touch();
  /// Whether anyone has attached to it or stepped it.
  bool used() const;

  /// Whether a frame may be refused because too many wait.
  enum class Admission {
    kBounded,  ///< at most the mailbox's capacity may wait
    kAlways,   ///< for callers that bound their frames themselves
  };

  /// Steps to `frame` by the rule of step.proto; INVALID_ARGUMENT for a next frame that is not complete.
  /// `done` is called exactly once: on a runner's thread, or before this returns: for a frame that is refused
  /// with RESOURCE_EXHAUSTED, and for a brief step (step_cost.h) with kAlways, which the calling thread
  /// takes, and those that wait by then and are brief together with it, while the runner has room for guests.
  /// A frame whose client gives up is left undone, CANCELLED: the session is then as it was before it.
  /// ABORTED for a frame of a stream that was taken over, once the one that took over has been told where the
  /// session stands.
  /// A trial of the next frame is answered in the same way and leaves the session where it is.
  /// INVALID_ARGUMENT for a question whose options are out of range, or above the session's max_contacts.
  void step(std::uint64_t frame, FrameBuffer contents, AdmittedFrame pass, Admission admission, StepDone done,
            Before before = {}, Question question = {});

  /// Makes `frame` of the last trial, up to `fraction` of its way, as Collider::commit() does, by the rule of
  /// frames: the same fraction is answered again, another one is ABORTED. FAILED_PRECONDITION where no trial
  /// was answered since the last frame or change, or where a motion failed since. `done` as in step(), with
  /// kAlways.
  void commit(std::uint64_t frame, double fraction, AdmittedFrame pass, StepDone done, Before before = {});

  /// Carries out the changes in order, all of them or none: FAILED_PRECONDITION unless `next_frame` is the
  /// frame expected then, ABORTED unless the session is in the state `expected`. With the key of the last
  /// order that was carried out the answer to that is given again, without `before`; INVALID_ARGUMENT when
  /// its changes were others. `done` is called as in step().
  /// CANCELLED, with nothing changed, when the client gives up before all of them are carried out.
  void change(ChangeOrder order, ChangeDone done, Before before = {});

  /// Checks, in its turn, what the collider keeps, as step() does by itself every limits.self_check_steps:
  /// what was found broken, which is made anew in the next step, or nothing; DATA_LOSS, and the session is
  /// dropped, where that is not possible, or the second time. `done` is called as in step().
  void check(CheckDone done, std::shared_ptr<std::atomic<bool>> given_up = nullptr);

  /// Makes a stream the session's only one. ABORTED when another holds it, unless `takeover`: the other is
  /// evicted then. `done` gets where the session stands, on a runner's thread, once all earlier frames are
  /// done.
  Outcome<Attachment> attach(bool takeover, Evict evict, AttachDone done);
  /// Does nothing when the attachment was taken over.
  void detach(Attachment attachment);

  /// Ends the session: frames that wait get `fault`, and so does the one being computed, which is given up;
  /// the stream is evicted. Only the first call counts.
  void close(Fault fault);
  /// close() as NOT_FOUND, with what became of the session: "expired". Never throws: without memory for the
  /// words it has fewer.
  void close_as(const char* what) noexcept;

 private:
  /// What a frame is made of, by which it is told from another of its number: what was asked of which
  /// positions, or how much of the last trial is taken.
  struct Asked {
    FrameBuffer contents;
    Question question;
    friend bool operator==(const Asked&, const Asked&) = default;
  };
  struct Committed {
    double fraction;
    friend bool operator==(const Committed&, const Committed&) = default;
  };
  using Content = std::variant<Asked, Committed>;
  /// A frame on its way.
  struct Request {
    std::uint64_t frame;
    Content content;
    AdmittedFrame pass;
    StepDone done;
    Before before;
    std::chrono::steady_clock::time_point arrived = std::chrono::steady_clock::now();
  };

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

  void take(const std::shared_ptr<Request>& request, Admission admission);
  Outcome<std::shared_ptr<const Answer>> compute(Request& request);
  Fault taken_over() const;
  Outcome<std::shared_ptr<const Answer>> repeated(const Request& request) const;
  Outcome<std::shared_ptr<const Answer>> ask(Request& request, Asked& asked);
  Outcome<std::shared_ptr<const Answer>> take_trial(const Request& request, Committed committed);
  /// With the options of the session where it has none; INVALID_ARGUMENT as step().
  Outcome<Question> within_limits(Question question) const;
  /// The frame was answered, and is the session's last. Cannot fail.
  void finish_frame(std::shared_ptr<const Answer> answer, Content content) noexcept;
  Fault out_of_order(std::uint64_t frame) const;
  Outcome<std::shared_ptr<const Answer>> compute_guarded(Request& request) noexcept;
  Outcome<std::string> self_check(const std::string& where, const std::atomic<bool>* stop);
  std::optional<Fault> too_large_with(std::span<const SceneChange> changes) const;
  /// Growth that the changes bring, as estimate_bytes() estimates it.
  std::size_t growth_with(std::span<const SceneChange> changes) const;
  /// The growth, as far as it is more than the order holds already.
  std::size_t more_with(const ChangeOrder& order) const;
  /// The same refusal, which says so where bodies that were removed hold a good part of the scene.
  Fault with_removed(Fault refusal) const;
  std::optional<Fault> refusal_of(const ChangeOrder& order) const;
  /// What a request ends with whose client gave up, or whose session was closed meanwhile.
  Fault given_up(const std::string& what) const;

  void advance(const SessionState& next) { standing_ = {next, standing_.now}; }
  Outcome<SessionState> apply(ChangeOrder& order, const Before& before);
  // Runs work on the collider, which without memory leaves everything as it was; what it throws becomes a
  // fault, and but for std::bad_alloc the session is lost then.
  template <class T, class Work>
  Outcome<T> guarded(const char* what, Work work) noexcept;
  /// A request that close() can stop, for as long as it lives.
  class Running;
  void take_stock();
  void plan_next();
  bool check_is_due() const;
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
  const Limits& limits_;
  const std::shared_ptr<Tenant> tenant_;  // may be null
  const std::shared_ptr<Mailbox> mailbox_;
  const std::shared_ptr<Account> account_;
  const std::shared_ptr<SessionCompanion> companion_;

  // Used by jobs of the mailbox only, which run one at a time.
  Collider collider_;
  Holding memory_;  // of the collider
  FrameSequence frames_;
  Standing standing_;
  /// The last that was carried out and had a key.
  struct DoneOrder {
    std::string key;
    std::uint64_t digest;
    SessionState state;
  };
  std::optional<DoneOrder> done_order_;
  std::uint32_t steps_unchecked_ = 0;
  /// The last stream that was told where the session stands: frames of earlier ones are refused.
  Attachment holder_{};
  bool was_rebuilt_ = false;       // after a self-check
  bool stepped_ = false;           // the last request was a step, and was carried out
  std::atomic<bool> stop_{false};  // a request whose client cannot give it up
  double next_ms_;                 // step_cost_ms() of the next step, or more when one outgrew that
  double took_ms_ = 0;             // by the last request
  std::shared_ptr<const Answer> last_answer_;
  std::optional<Content> last_frame_;  // what it answers
  /// A digest of what the last trial was about, where it may be committed.
  std::optional<std::uint64_t> trial_;
  // Of the last question that was computed: what the next one will take is told by it.
  StepCounts last_counts_;
  std::optional<StepCounts> last_counts_beside_;  // with options.explain

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
  Evict evict_ WARMFRONT_GUARDED_BY(mutex_);
};

}  // namespace warmfront::server
