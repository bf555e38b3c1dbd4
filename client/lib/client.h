// SPDX-License-Identifier: Apache-2.0
// The client of a Warmfront daemon: sessions that are stepped frame by frame and survive the daemon.
// A Client is thread-safe. A Session is used by one thread at a time; different sessions are independent.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/lib/answer.h"
#include "engine/collider.h"
#include "engine/options.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

/// How a daemon is known, and who the client is. Files are PEM and read when the client connects.
struct ClientSecurity {
  bool tls = false;       ///< encrypt; any of the next three files sets it
  std::string ca_file;    ///< who signed the daemon's certificate; empty: whom the system trusts
  std::string cert_file;  ///< the client's own certificate and its key, for daemons that demand one
  std::string key_file;
  std::string server_name;  ///< that the daemon's certificate must bear; empty: the address's host
  /// A file that holds the token to send, and nothing else. Without TLS only to this machine.
  std::string token_file;
};

/// How to reach a daemon, and how long to wait for what. All times are positive.
struct ClientOptions {
  ClientSecurity security = {};
  std::chrono::milliseconds call_timeout = std::chrono::seconds(10);   ///< connecting, and small calls
  std::chrono::milliseconds create_timeout = std::chrono::minutes(5);  ///< uploading and building a scene
  std::chrono::milliseconds answer_timeout =
      std::chrono::minutes(5);  ///< one frame; then the session is resumed
  std::chrono::milliseconds resume_timeout =
      std::chrono::minutes(1);  ///< finding a daemon again after losing it
  /// Resumes in a row without an answer in between, after which a session gives up: a frame that brings every
  /// daemon down must not be sent forever.
  int max_resumes_without_answer = 5;
  /// Told, on the thread that uses the session, why it lost its daemon, before it looks for one again.
  std::function<void(const Error& why)> on_lost = {};
};

struct SessionOptions {
  /// A UUID; a random one when empty.
  std::string id;
  /// The number of the positions that the session is created with; the first step is the next.
  std::uint64_t first_frame = 0;
};

/// A session of a daemon. It keeps the scene, the positions last answered and the frames unanswered, so that
/// it can be created again: when the daemon dies, restarts, drains or forgets it, the session goes on there
/// or at whatever daemon the address leads to by then, with exactly one answer to each frame, in order and of
/// the same bits. A copy that a daemon still has is gone on with where it is in this session's own state,
/// which the daemon states; another, and that of a daemon too old to state it, is deleted and made again. A
/// limit that is met on the way, and that others fill, is waited for within the resume timeout. After an
/// error of kUnavailable, kDeadlineExceeded, kAborted or kInternal every further call gives that error.
class Session {
 public:
  ~Session();  ///< close(), its error ignored
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  const std::string& id() const;
  /// Frames that may be unanswered at once.
  std::uint32_t window() const;
  /// How often the session was resumed.
  std::uint64_t resumes() const;

  /// Submits a frame and takes its answer. kFailedPrecondition while earlier answers were not taken.
  Result<Answer> step(const Frame& frame);

  /// Sends the next frame, all of it or only what moved, and returns its number. Positions are of the kind
  /// (float or double) that the session was created with, poses travel as that kind; kInvalidArgument where
  /// something does not fit the scene. kFailedPrecondition when `window` frames are unanswered, or when a
  /// frame failed and answers to frames after it were not taken yet.
  Result<std::uint64_t> submit(const Frame& frame);

  /// Adds a body at rest at `positions`, (k, 3), of the session's kind, and returns its index; as
  /// Collider::add_body(). It is carried out once, whatever becomes of the daemon on the way; what a daemon
  /// refuses leaves the session as it was. kFailedPrecondition while frames are unanswered.
  Result<std::uint32_t> add_body(BodyAddition addition, const Positions& positions);
  /// Describes a body differently, as Collider::change_body(); once, as add_body(). kFailedPrecondition while
  /// frames are unanswered.
  Status change_body(std::uint32_t index, Body body);

  /// Waits for the answer to the oldest unanswered frame. An error in the frame itself (kInvalidArgument,
  /// kResourceExhausted) does not count as a step: frames sent after it fail with kFailedPrecondition, and
  /// once all are taken the next submit() has the failed frame's number. kFailedPrecondition when no frame is
  /// unanswered.
  Result<Answer> next_answer();

  /// Deletes the session in the daemon; unanswered frames are given up. Further calls fail. A daemon that
  /// is being started again is waited for, some two seconds; then kUnavailable.
  Status close();

 private:
  friend class Client;
  struct Impl;
  explicit Session(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

class Client {
 public:
  /// Connects to `HOST:PORT` or `unix:PATH`; kInvalidArgument for anything else, such as an URL. kUnavailable
  /// when no daemon answers within the call timeout, which is also what a failed TLS handshake looks like;
  /// kUnauthenticated for a token that it does not know; kInvalidArgument for files that cannot be read, and
  /// for a token that would travel in the clear.
  static Result<Client> connect(const std::string& address, const ClientOptions& options = {});
  ~Client();
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;

  /// Uploads the scene and its positions at the first frame, (n, 3) row-major; float positions travel and
  /// stay as float32. Vertices in no face are tested as points against faces, and against nothing else
  /// (Scene::isolated_vertices() counts them). Fails as Scene::create() and Collider::create() do, with
  /// kAlreadyExists for an id that is taken and kResourceExhausted beyond the daemon's limits.
  Result<Session> create_session(SceneDescription scene, const Positions& positions,
                                 const ColliderOptions& options = {}, const SessionOptions& session = {});

  /// Those of this principal.
  Result<std::vector<SessionInfo>> list_sessions();
  /// kNotFound for an unknown session. Keeps it from expiring, which list_sessions() does not.
  Result<SessionInfo> get_session(const std::string& id);
  Status delete_session(const std::string& id);
  /// Has the daemon check what it keeps for a session: what was found broken, and is made anew in the next
  /// step; empty when nothing. kDataLoss when the session is lost to it.
  Result<std::string> check_session(const std::string& id);
  /// For administrators, kPermissionDenied for others: the sessions of all principals.
  Result<std::vector<SessionInfo>> list_all_sessions();
  /// As delete_session(), whoever made it; kFailedPrecondition where several principals have chosen one id,
  /// unless `principal` says whose is meant.
  Status delete_any_session(const std::string& id, const std::string& principal = {});
  Result<ServerInfo> server_info();

 private:
  struct Impl;
  explicit Client(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace warmfront::client
