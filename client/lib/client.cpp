// SPDX-License-Identifier: Apache-2.0
// The public interface over Connection and Session::Impl. Thread safety as stated in the header.
#include "client/lib/client.h"

#include <algorithm>
#include <utility>

#include "client/lib/address.h"
#include "client/lib/connection.h"
#include "client/lib/session_impl.h"
#include "client/lib/uuid.h"
#include "engine/scene/description_checks.h"
#include "proto/wire/trace_context.h"

namespace warmfront::client {
namespace {

Status check_traceparent(const std::string& traceparent) {
  if (traceparent.empty() || wire::TraceContext::parse(traceparent)) return {};
  return invalid_argument("traceparent '" + traceparent + "': " + wire::kTraceparentExpected);
}

}  // namespace

struct Client::Impl {
  Impl(const std::string& address, const ClientOptions& options, const Credentials& credentials)
      : connection(std::make_shared<Connection>(address, options, credentials)) {}
  const std::shared_ptr<Connection> connection;
};

Client::Client(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;

Result<Client> Client::connect(const std::string& address, const ClientOptions& options) {
  if (!is_server_address(address)) return invalid_argument("address '" + address + "': " + kAddressExpected);
  if (std::optional<std::string> folder = missing_folder(address))
    return Error{ErrorCode::kUnavailable, address + ": there is no folder " + *folder +
                                              "; is this the path of the daemon's --listen?"};
  if (Status valid = check_traceparent(options.traceparent); !valid) return valid.error();
  const Result<Credentials> credentials = read_credentials(address, options.security);
  if (!credentials) return credentials.error();
  auto impl = std::make_shared<Impl>(address, options, credentials.value());
  v1::GetServerInfoResponse response;
  if (const auto error = impl->connection->server_info(response)) return error->error;
  return Client(std::move(impl));
}

Result<Session> Client::create_session(SceneDescription scene, const Positions& positions,
                                       const ColliderOptions& options, const SessionOptions& session) {
  if (Status valid = check_traceparent(session.traceparent); !valid) return valid.error();
  // Other text than UTF-8 a daemon cannot read, nor say where it is.
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (Status name = check_name(scene.bodies[i].name, name_of(i)); !name) return name.error();
  }
  v1::SessionHeader header;
  header.set_session_id(session.id.empty() ? random_uuid() : session.id);
  header.set_first_frame(session.first_frame);
  Result<v1::ColliderOptions> sent = session_options(options);
  if (!sent) return sent.error();
  *header.mutable_options() = std::move(sent).value();
  auto impl = std::make_shared<Session::Impl>(impl_->connection, std::move(header),
                                              SceneState(std::move(scene), positions), session.traceparent);
  if (const Status opened = impl->open(); !opened) return opened.error();
  return Session(std::move(impl));
}

Result<std::vector<SessionInfo>> Client::list_sessions() {
  v1::ListSessionsResponse response;
  if (const auto error = impl_->connection->list(response)) return error->error;
  std::vector<SessionInfo> sessions;
  for (const v1::SessionInfo& session : response.sessions()) sessions.push_back(session_info_from(session));
  return sessions;
}

Result<SessionInfo> Client::get_session(const std::string& id) {
  v1::GetSessionResponse response;
  if (const auto error = impl_->connection->get(id, response)) return error->error;
  return session_info_from(response.session());
}

Status Client::delete_session(const std::string& id) {
  if (const auto error = impl_->connection->remove(id)) return error->error;
  return {};
}

Result<std::string> Client::check_session(const std::string& id) {
  v1::CheckSessionResponse response;
  if (const auto error = impl_->connection->check(id, response)) return error->error;
  return response.found();
}

Result<std::vector<SessionInfo>> Client::list_all_sessions() {
  v1::ListAllSessionsResponse response;
  if (const auto error = impl_->connection->list_all(response)) return error->error;
  std::vector<SessionInfo> sessions;
  for (const v1::OwnedSession& owned : response.sessions()) {
    sessions.push_back(session_info_from(owned.session()));
    sessions.back().principal = owned.principal();
  }
  return sessions;
}

Status Client::delete_any_session(const std::string& id, const std::string& principal) {
  if (const auto error = impl_->connection->remove_any(id, principal)) return error->error;
  return {};
}

Result<ServerInfo> Client::server_info() {
  v1::GetServerInfoResponse response;
  if (const auto error = impl_->connection->server_info(response)) return error->error;
  return server_info_from(response);
}

Session::Session(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

const std::string& Session::id() const {
  return impl_->id();
}
std::uint32_t Session::window() const {
  return impl_->window();
}
std::uint64_t Session::resumes() const {
  return impl_->resumes();
}

bool Session::shares_memory() const {
  return impl_->shares_memory();
}

std::shared_ptr<PendingAnswer> Session::ask(const Frame& frame, const Question& question,
                                            const WaitOptions& wait, bool handed_out) {
  return impl_->ask(frame, question, wait, handed_out);
}
std::shared_ptr<PendingAnswer> Session::ask_commit(double fraction, const WaitOptions& wait,
                                                   bool handed_out) {
  return impl_->ask_commit(fraction, wait, handed_out);
}
Result<std::uint64_t> Session::submit(const Frame& frame, const Question& question) {
  return impl_->submit(frame, question);
}
Result<std::uint64_t> Session::submit_commit(double fraction) {
  return impl_->submit_commit(fraction);
}
Result<std::vector<double>> Session::positions() const {
  return impl_->positions();
}
Result<std::vector<BodyPose>> Session::poses() const {
  return impl_->poses();
}

Status Session::replace_elements(std::uint32_t index, std::vector<std::array<std::int32_t, 3>> faces,
                                 std::vector<std::array<std::int32_t, 2>> edges) {
  return impl_->change(ReplaceElements{index, std::move(faces), std::move(edges)});
}

Status Session::replace_body(std::uint32_t index, BodyAddition with, const Positions& positions) {
  return impl_->change(PutBody{index, std::move(with), positions});
}

Result<std::uint32_t> Session::add_body(BodyAddition addition, const Positions& positions) {
  const std::uint32_t index = impl_->body_count();
  if (Status added = impl_->change(PutBody{std::nullopt, std::move(addition), positions}); !added)
    return added.error();
  return index;
}
Status Session::change_body(std::uint32_t index, Body body) {
  return impl_->change(ChangeBody{index, std::move(body)});
}
Status Session::change_filters(PairFilters filters) {
  return impl_->change(ChangeFilters{std::move(filters)});
}
Status Session::change_excluded_pairs(std::vector<std::array<std::uint32_t, 2>> pairs) {
  return impl_->change(ChangeExcludedPairs{std::move(pairs)});
}
Status Session::change(std::vector<SceneChange> changes, const std::optional<ColliderOptions>& options) {
  return impl_->change(std::move(changes), options);
}
Status Session::change_options(const ColliderOptions& options) {
  return impl_->change_options(options);
}
Result<Answer> Session::next_answer() {
  return impl_->next_answer();
}
Status Session::close() {
  return impl_->close();
}

}  // namespace warmfront::client
