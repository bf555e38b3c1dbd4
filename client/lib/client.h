// SPDX-License-Identifier: Apache-2.0
// The client of a Warmfront daemon: sessions that are stepped frame by frame and survive the daemon's
// restart.
// A Client is thread-safe. A Session is used by one thread at a time; different sessions are independent.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/lib/answer.h"
#include "client/lib/questions.h"
#include "engine/collider.h"
#include "engine/frame.h"
#include "engine/options.h"
#include "engine/question.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

/// How to authenticate the daemon and the client. Files are PEM and read when the client connects.
struct ClientSecurity {
  bool tls = false;       ///< encrypt; implied by any of the next three files
  std::string ca_file;    ///< CA of the daemon's certificate; empty: the system's CAs
  std::string cert_file;  ///< the client's certificate and key, for daemons that require them
  std::string key_file;
  std::string server_name;  ///< expected in the daemon's certificate; empty: the address's host
  /// A file that contains only the token to send. Without TLS only to this machine.
  std::string token_file;
};

/// How to reach a daemon, and time limits. All times are positive.
struct ClientOptions {
  ClientSecurity security = {};
  std::chrono::milliseconds call_timeout = std::chrono::seconds(10);   ///< connecting, and small calls
  std::chrono::milliseconds create_timeout = std::chrono::minutes(5);  ///< uploading and building a scene
  std::chrono::milliseconds answer_timeout =
      std::chrono::minutes(5);  ///< one frame; then the session is resumed
  std::chrono::milliseconds resume_timeout =
      std::chrono::minutes(1);  ///< finding a daemon again after losing it, or one for a new session; the
                                ///< last try may take a call_timeout more
  /// Share memory with a daemon that is reached by a Unix socket and offers it: positions and answers go
  /// through it, with the same bits, and the daemon charges it to the session. Otherwise, and where there is
  /// none, all goes by the socket.
  bool shared_memory = true;
  /// There, a daemon that sleeps is told of a frame before its positions are written, and wakes up meanwhile,
  /// where these have so many bytes or more: fewer are written in less time than one more message takes. Not
  /// while answers are awaited.
  std::size_t early_frame_bytes = std::size_t{128} << 10;
  /// The caller's span, as the `traceparent` of W3C Trace Context says it: the daemon's spans of frames,
  /// where it exports traces, are below it, if its flag says that it is sampled. Sent with every call. Empty:
  /// none.
  std::string traceparent = {};
  /// A session fails after this many consecutive resumes without an answer, so that a frame that crashes
  /// every daemon is not sent forever.
  int max_resumes_without_answer = 5;
  /// Called on the thread that uses the session with the reason for losing the daemon, before the session
  /// looks for one again.
  std::function<void(const Error& why)> on_lost = {};
};

struct SessionOptions {
  /// A UUID; a random one when empty.
  std::string id = {};
  /// Frame number of the positions that the session is created with; the first step is the next.
  std::uint64_t first_frame = 0;
  /// Of this session's frames, in place of the client's: see ClientOptions::traceparent.
  std::string traceparent = {};
};

/// A session of a daemon. It keeps the scene, the positions last answered, the last trial and the frames
/// unanswered, so that it can be created again: when the daemon dies, restarts, drains or forgets it, the
/// session goes on there or at whatever daemon the address leads to by then, with exactly one answer to each
/// frame, in order and of the same bits. A copy that a daemon still has is reused where its state, which the
/// daemon reports, is this session's; another one, and that of a daemon too old to report it, is deleted and
/// created again. Where the daemon is full of other sessions meanwhile, the client waits for room, at most
/// the resume timeout. After an error of kUnavailable, kDeadlineExceeded, kAborted or kInternal, and one that
/// says that the session could not be resumed, as where another daemon has lower limits, every further call
/// gives that error.
class Session final : public Questions {
 public:
  ~Session();  ///< calls close() and ignores its error
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  const std::string& id() const;
  /// Most frames that may be unanswered at once.
  std::uint32_t window() const;
  /// How often the session was resumed after it lost its daemon; questions that were given up do not count.
  std::uint64_t resumes() const;
  /// Whether whole frames and answers go through memory that the daemon shares, and not through its socket:
  /// false between two connections.
  bool shares_memory() const;

  /// Sends the next frame, all of it or only what moved, and returns its number. Positions are of the kind
  /// (float or double) that the session was created with, poses are rounded to that kind; kInvalidArgument
  /// where something does not fit the scene. kFailedPrecondition when `window` frames are unanswered, or when
  /// a frame failed and answers to frames after it were not taken yet. What does not count, a trial for
  /// example, has the number of the frame that it is about, which the next frame gets, too.
  Result<std::uint64_t> submit(const Frame& frame, const Question& question = {});
  /// Sends a commit of the trial submitted last, and returns the number of the frame that it makes. Whether
  /// there is that trial is known when it was answered: next_answer() has kFailedPrecondition where it
  /// failed.
  Result<std::uint64_t> submit_commit(double fraction = 1);

  /// Where everything is after the answers that were taken: as Collider::positions() and poses(), to the bit,
  /// known here without the daemon, also after it was lost for good. Bodies at a pose are placed by
  /// Pose::place(), which does not round to float32; where removed bodies are means nothing.
  /// kFailedPrecondition while frames are unanswered. O(n).
  Result<std::vector<double>> positions() const;
  Result<std::vector<BodyPose>> poses() const;

  /// Adds a stationary body at `positions`, (k, 3), of the session's type, and returns its index; see
  /// Collider::add_body(). Carried out exactly once, even if the daemon is lost; a refused change leaves the
  /// session unchanged. kFailedPrecondition while frames are unanswered.
  Result<std::uint32_t> add_body(BodyAddition addition, const Positions& positions);
  /// Changes a body's description, see Collider::change_body(); exactly once, like add_body().
  /// kFailedPrecondition while frames are unanswered.
  Status change_body(std::uint32_t index, Body body);
  /// Other faces and edges for the vertices of a body, see Collider::replace_elements(), with which numbers
  /// change as it says; exactly once, like add_body(), in pieces where it is large.
  /// kFailedPrecondition while frames are unanswered, kUnimplemented where the daemon is older than this.
  Status replace_elements(std::uint32_t index, std::vector<std::array<std::int32_t, 3>> faces,
                          std::vector<std::array<std::int32_t, 2>> edges = {});
  /// Another body with this index, stationary at `positions`, (k, 3), of the session's type: see
  /// Collider::replace_body(). As replace_elements().
  Status replace_body(std::uint32_t index, BodyAddition with, const Positions& positions);
  /// Other filters in place of all that there are, see Collider::change_filters(); exactly once, like
  /// add_body(). kFailedPrecondition while frames are unanswered, kUnimplemented where the daemon is older
  /// than filters.
  Status change_filters(PairFilters filters);
  /// Other pairs of bodies that are not tested against each other, in place of all that there are, see
  /// Collider::change_excluded_pairs(); exactly once, like add_body(). kFailedPrecondition while frames are
  /// unanswered, kUnimplemented where the daemon is older than this.
  Status change_excluded_pairs(std::vector<std::array<std::uint32_t, 2>> pairs);
  /// Other options from the next question on, see Collider::change_options(); otherwise as
  /// change_excluded_pairs().
  Status change_options(const ColliderOptions& options);
  /// Carries out changes as the functions above do, one after the other, all of them or none, and with them
  /// other options: see Collider::change(). Exactly once, like add_body(). Errors name the change,
  /// "changes[i]: ". kInvalidArgument for positions that a session of float32 does not hold exactly.
  Status change(std::vector<SceneChange> changes,
                const std::optional<ColliderOptions>& options = std::nullopt);

  /// Waits for the answer to the oldest unanswered frame, trials and commits among them. An error in the
  /// frame itself (kInvalidArgument, kResourceExhausted) does not count as a step: frames sent after it fail
  /// with kFailedPrecondition, and once all are taken the next submit() has the failed frame's number.
  /// kFailedPrecondition when no frame is unanswered. Of what was submitted alone: a Pending has its own.
  Result<Answer> next_answer();

  /// Deletes the session in the daemon; unanswered frames are dropped. Further calls fail. Waits about two
  /// seconds for a restarting daemon; then kUnavailable.
  Status close();

 private:
  friend class AnySession;
  friend class Client;
  struct Impl;
  explicit Session(std::shared_ptr<Impl> impl);
  std::shared_ptr<PendingAnswer> ask(const Frame& frame, const Question& question, const WaitOptions& wait,
                                     bool handed_out) override;
  std::shared_ptr<PendingAnswer> ask_commit(double fraction, const WaitOptions& wait,
                                            bool handed_out) override;

  std::shared_ptr<Impl> impl_;  // no other holds it, but for a Pending that waits
};

class Client {
 public:
  /// Connects to `HOST:PORT` or `unix:PATH`; kInvalidArgument for anything else, for example a URL.
  /// kUnavailable when no daemon answers within the call timeout, including a failed TLS handshake;
  /// kUnauthenticated for an unknown token; kInvalidArgument for unreadable files, and for a token that would
  /// be sent unencrypted, and a traceparent that is none.
  static Result<Client> connect(const std::string& address, const ClientOptions& options = {});
  ~Client();
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;

  /// Uploads the scene and its positions at the first frame, (n, 3) row-major; float positions are sent and
  /// stored as float32. Vertices in no face and no edge are points: tested against faces and, with a
  /// separation or thickness, against edges of no face and each other
  /// (Scene::isolated_vertices()). Filters that need a rest shape and have none take these positions. Fails
  /// as Scene::create() and Collider::create() do, as connect() for a traceparent, with kAlreadyExists for an
  /// id in use, kResourceExhausted beyond the daemon's limits, and kUnimplemented for filters where the
  /// daemon is older than they are.
  Result<Session> create_session(SceneDescription scene, const Positions& positions,
                                 const ColliderOptions& options = {}, const SessionOptions& session = {});

  /// The sessions of this principal.
  Result<std::vector<SessionInfo>> list_sessions();
  /// kNotFound for an unknown session. Keeps it from expiring, which list_sessions() does not.
  Result<SessionInfo> get_session(const std::string& id);
  Status delete_session(const std::string& id);
  /// Runs the daemon's self-check of a session. Returns the fault, whose data the next step recomputes; empty
  /// if there is none. kDataLoss when the session is lost.
  Result<std::string> check_session(const std::string& id);
  /// The sessions of all principals; kPermissionDenied without the admin role.
  Result<std::vector<SessionInfo>> list_all_sessions();
  /// As delete_session(), for any principal's session; kFailedPrecondition if several principals use this id
  /// and `principal` does not select one.
  Status delete_any_session(const std::string& id, const std::string& principal = {});
  Result<ServerInfo> server_info();

 private:
  struct Impl;
  explicit Client(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace warmfront::client
