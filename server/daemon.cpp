// SPDX-License-Identifier: Apache-2.0
// Building, serving, draining. Thread safety as stated in the header.
#include "server/daemon.h"

#include <google/protobuf/stubs/logging.h>
#include <grpcpp/ext/channelz_service_plugin.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/service_type.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <utility>

#include "server/annotations.h"
#include "server/auth/certificates.h"
#include "server/observe/http.h"
#include "server/observe/liveness.h"
#include "server/observe/metrics_text.h"
#include "server/process/accept.h"
#include "server/process/free_memory.h"
#include "server/process/guarded_receive.h"
#include "server/process/listen.h"
#include "server/process/small_file.h"
#include "server/process/socket_lock.h"
#include "server/process/ticker.h"
#include "server/transport/admin_service.h"
#include "server/transport/context.h"
#include "server/transport/health_service.h"
#include "server/transport/service.h"

namespace warmfront::server {
namespace {

using std::chrono::milliseconds;

/// How long a stream must be quiet after the notice to be ended: many round trips, for what is under way
/// already.
constexpr milliseconds kQuiet{300};
/// How often that is looked at.
constexpr milliseconds kGlance{50};
/// How often freed memory is looked for, and connections that were ended are logged.
constexpr milliseconds kGlanceAtProcess{1000};
/// How often certificate files are looked at.
constexpr milliseconds kCertificateGlance{500};
/// How long calls of other services (health watches, reflection) get to end by themselves.
constexpr milliseconds kOthers{200};

void set_arguments(grpc::ServerBuilder& builder, const Config& config) {
  const int message_bytes = static_cast<int>(config.limits.max_message_bytes);
  builder.SetMaxReceiveMessageSize(message_bytes);
  // An answer chunk holds at most answer_chunk_bytes of contacts, or one row, and a summary.
  builder.SetMaxSendMessageSize(
      static_cast<int>(std::max(config.limits.max_message_bytes, config.limits.answer_chunk_bytes + 4096)));
  // The message limit alone does not bound memory: a message is buffered whole before it is refused.
  builder.SetResourceQuota(grpc::ResourceQuota("warmfrontd").Resize(config.transport_memory_bytes));
  // The quota does not see what a compressed message becomes.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  // Two daemons would otherwise share a port in silence.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             static_cast<int>(config.limits.max_streams_per_connection));
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, static_cast<int>(config.max_metadata_bytes));
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 10'000);
  // Clients that vanish are found within a minute and a half; clients may ping every ten seconds.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 60'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 30'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
}

/// These plugins are switches of the whole process in gRPC: once on, every server built later has them.
void enable_plugins(bool reflection, bool channelz) {
  static Mutex mutex;
  static bool reflecting = false, channels = false;
  const MutexLock lock(mutex);
  // It writes what clients send wrong to standard error in lines of its own; the status that they get says it
  // all.
  google::protobuf::SetLogHandler(nullptr);
  if (reflection && !std::exchange(reflecting, true))
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  if (channelz && !std::exchange(channels, true)) grpc::channelz::experimental::InitChannelzService();
}

bool uses_tls(const std::string& address, const TlsFiles& tls) {
  return tls.enabled() && !address.starts_with("unix:");
}

/// gRPC reads the files again every second. They are not those of the user, which may be anything by then:
/// Debian's gRPC 1.51 ends the process for an empty one.
std::shared_ptr<grpc::ServerCredentials> encrypted_by(const TlsFiles& files) {
  constexpr unsigned kReloadSeconds = 1;
  using namespace grpc::experimental;
  TlsServerCredentialsOptions options(std::make_shared<FileWatcherCertificateProvider>(
      files.key, files.certificate, files.client_ca, kReloadSeconds));
  options.watch_identity_key_cert_pairs();
  if (!files.client_ca.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return TlsServerCredentials(options);
}

struct ConnectionCounts {
  std::array<std::uint64_t, Http2Guard::kVerdicts> ended = connections_ended();
  std::uint64_t refused = connections_refused();
};

/// One line for those that were ended since `seen`, and one for those that were refused; `seen` is brought up
/// to date. Whoever floods the daemon does not flood its log.
void log_connections(Log& log, ConnectionCounts& seen) {
  const ConnectionCounts counts;
  const auto& now = counts.ended;
  std::string reasons;
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] == seen.ended[i]) continue;
    count += now[i] - seen.ended[i];
    if (!reasons.empty()) reasons.push_back(' ');
    reasons.append(Http2Guard::kNames[i]);
  }
  if (count > 0) log.write(LogLevel::kWarning, "connections_ended", {{"count", count}, {"reason", reasons}});
  if (counts.refused > seen.refused)
    log.write(LogLevel::kWarning, "connections_refused",
              {{"count", counts.refused - seen.refused}, {"reason", "max-connections-per-address"}});
  seen = counts;
}

/// How often to look for what has outlived `timeout`, so that it does by a quarter at most.
milliseconds period_for(milliseconds timeout, milliseconds most) {
  return std::clamp(timeout / 4, milliseconds(10), most);
}

/// Forgets sessions that nobody has used for a while.
void close_idle_sessions(Context& context, Log& log) {
  for (const std::shared_ptr<Session>& session : context.store.remove_idle(context.limits.idle_timeout)) {
    session->close_as("expired");
    ++context.metrics.sessions_ended[Metrics::kExpired];
    log.write(LogLevel::kInfo, "session_closed", {{"session", session->id().text()}, {"reason", "idle"}});
  }
}

/// Once at each start: a token or key that every user may read is theirs as well.
void warn_of_readable_secrets(Log& log, const Config& config) {
  const std::array<std::pair<const char*, const std::string*>, 2> secrets{
      {{"token-file", &config.token_file}, {"tls-key", &config.tls.key}}};
  for (const auto& [setting, path] : secrets)
    if (is_readable_by_others(*path))
      log.write(
          LogLevel::kWarning, "secret_readable",
          {{"file", *path},
           {"reason", std::string(setting) + ": every user of this machine may read it; chmod o= it, and "
                                             "replace what it holds if there are such users"}});
}

std::string with_port(const std::string& address, int port) {
  return address.starts_with("unix:") ? address
                                      : address.substr(0, address.rfind(':') + 1) + std::to_string(port);
}

}  // namespace

struct Daemon::Impl {
  Impl(const Config& config, Log& log, std::unique_ptr<Guard> the_guard,
       std::shared_ptr<Certificates> the_certificates, Quotas the_quotas)
      : drain_timeout(config.drain_timeout),
        quotas(std::move(the_quotas)),
        guard(std::move(the_guard)),
        certificates(std::move(the_certificates)),
        context(config.limits, config.threads, log, *guard) {}

  // Constant after start(). The locks are held until the server has given its sockets up.
  const milliseconds drain_timeout;
  const Quotas quotas;  // of the configuration
  std::vector<SocketLock> sockets;
  std::vector<std::string> addresses;

  // Thread-safe. In this order: the server uses the service, which uses the context.
  const std::unique_ptr<Guard> guard;
  const std::shared_ptr<Certificates> certificates;  // null: no TLS
  Context context;
  std::unique_ptr<Ticker> certificate_files;
  std::unique_ptr<Ticker> expiry;
  Liveness liveness;
  std::unique_ptr<Ticker> timeouts;
  std::unique_ptr<Ticker> memory;
  std::unique_ptr<grpc::Service> service;
  std::unique_ptr<grpc::Service> admin_service;
  HealthService health{kServiceName};
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<Http> http;

  /// The token file's words go before the configuration's.
  void set_quotas() {
    Quotas all = guard->quotas();
    all.insert(quotas.begin(), quotas.end());
    context.tenants.set_quotas(std::move(all));
  }

  /// Through the locks of calls, sessions and queues: where one of them is never given back, no beat comes.
  void beat() {
    static_cast<void>(context.store.size());
    liveness.beat({context.runner.done(), context.runner.busy() > 0, Liveness::processor_time()},
                  std::chrono::steady_clock::now());
  }

  std::string metrics() const {
    std::vector<Gauges::Tenant> tenants;
    for (const std::shared_ptr<Tenant>& tenant : context.tenants.list())
      tenants.push_back({tenant->name, context.store.count(tenant->name), tenant->memory.used(),
                         tenant->streams.inside(), tenant->frames.inside(), tenant->refused.load(),
                         tenant->quota()});
    return metrics_text(context.metrics, {.sessions = context.store.size(),
                                          .charged_bytes = context.budget.used(),
                                          .max_bytes = context.budget.limit(),
                                          .open_streams = context.streams.inside(),
                                          .frames_in_flight = context.frames.inside(),
                                          .threads = static_cast<std::uint64_t>(context.workers->threads()),
                                          .draining = context.lifecycle.draining(),
                                          .certificate_expiry = certificates ? certificates->expiry() : 0,
                                          .tenants = std::move(tenants)});
  }
};

Daemon::Daemon(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<Daemon>> Daemon::start(const Config& wanted, Log& log) {
  Config config = wanted;
  if (config.listen.empty()) return invalid_argument("listen: at least one address is expected");
  std::vector<SocketLock> sockets;
  for (const std::string& address : config.listen)
    if (const Status checked = check_listen_address(address, config.insecure || config.tls.enabled());
        !checked)
      return checked.error();
  for (const std::string& address : config.listen) {
    const std::optional<std::string> path = unix_path(address);
    if (!path) continue;
    Result<SocketLock> lock = SocketLock::acquire(*path);
    if (!lock) return lock.error();
    sockets.push_back(std::move(lock).value());
    // One that knows nothing of the lock.
    if (someone_listens(*path))
      return Error{ErrorCode::kFailedPrecondition,
                   "listen " + address + ": another process listens there; stop it first"};
  }
  if (!config.metrics_listen.empty() && !is_host_and_port(config.metrics_listen))
    return invalid_argument("metrics-listen " + config.metrics_listen +
                            ": HOST:PORT (an IPv6 host in brackets) is expected, the port in [0, 65535]");
  Result<std::unique_ptr<Guard>> guard =
      Guard::create({config.token_file, !config.tls.client_ca.empty(), config.admins});
  if (!guard) return guard.error();
  Result<Quotas> quotas = parse_quotas(config.quotas);
  if (!quotas) return quotas.error();
  std::shared_ptr<Certificates> certificates;
  if (config.tls.enabled()) {
    auto read = Certificates::create(config.tls, log);
    if (!read) return read.error();
    certificates = std::move(read).value();
  }

  warn_of_readable_secrets(log, config);
  for (const std::string& reason : fit_to_memory(config.limits))
    log.write(LogLevel::kWarning, "limits_beside_memory", {{"reason", reason}});
  enable_plugins(config.reflection, config.channelz);
  refuse_connections_without_files();
  auto impl = std::make_unique<Impl>(config, log, std::move(guard).value(), std::move(certificates),
                                     std::move(quotas).value());
  impl->sockets = std::move(sockets);
  impl->set_quotas();
  if (!config.record_dir.empty()) {
    auto recordings =
        Recordings::open(config.record_dir, config.record_max_bytes, log,
                         {.queue_bytes = config.record_queue_bytes, .flush_timeout = config.drain_timeout});
    if (!recordings) return recordings.error();
    impl->context.recordings = std::move(recordings).value();
  }
  impl->service = make_collision_service(impl->context);
  impl->admin_service = make_admin_service(impl->context);
  grpc::ServerBuilder builder;
  set_arguments(builder, config);
  std::vector<int> ports(config.listen.size(), 0);
  const std::shared_ptr<grpc::ServerCredentials> plain = grpc::InsecureServerCredentials();
  std::shared_ptr<grpc::ServerCredentials> encrypted;
  if (impl->certificates) {
    encrypted = encrypted_by(impl->certificates->in_force());
    impl->certificate_files = std::make_unique<Ticker>(
        kCertificateGlance, [files = impl->certificates, &metrics = impl->context.metrics] {
          if (!files->look()) ++metrics.reload_failures[Metrics::kCertificates];
        });
  }
  for (std::size_t i = 0; i < ports.size(); ++i)
    builder.AddListeningPort(config.listen[i], uses_tls(config.listen[i], config.tls) ? encrypted : plain,
                             &ports[i]);
  builder.RegisterService(impl->service.get());
  builder.RegisterService(impl->admin_service.get());
  builder.RegisterService(&impl->health);
  impl->server = builder.BuildAndStart();
  if (!impl->server) {
    // gRPC does not say why; the first port that it did not get is the reason.
    const auto failed = static_cast<std::size_t>(std::find(ports.begin(), ports.end(), 0) - ports.begin());
    const std::string& address = config.listen[std::min(failed, ports.size() - 1)];
    return Error{ErrorCode::kUnavailable, "listen " + address + ": " + why_not_bound(address)};
  }
  for (std::size_t i = 0; i < ports.size(); ++i) {
    impl->addresses.push_back(with_port(config.listen[i], ports[i]));
    const bool is_encrypted = uses_tls(config.listen[i], config.tls);
    log.write(LogLevel::kInfo, "listening",
              {{"address", impl->addresses.back()},
               {"encrypted", is_encrypted},
               {"authenticated", impl->guard->authenticates()}});
    if (is_local(config.listen[i]) || (is_encrypted && impl->guard->authenticates())) continue;
    log.write(LogLevel::kWarning, "insecure",
              {{"address", impl->addresses.back()},
               {"reason", is_encrypted
                              ? "whoever reaches this address may call; set --token-file or --tls-client-ca"
                              : "others can reach this address and nothing is encrypted"}});
  }
  impl->expiry =
      std::make_unique<Ticker>(period_for(config.limits.idle_timeout, milliseconds(10'000)),
                               [&log, &context = impl->context] { close_idle_sessions(context, log); });
  const milliseconds least = std::min(config.limits.upload_timeout, config.limits.write_stall_timeout);
  impl->timeouts = std::make_unique<Ticker>(period_for(least, milliseconds(1000)), [all = impl.get()] {
    all->context.lifecycle.enforce_timeouts();
    refuse_connections_left_waiting();
    all->beat();
  });
  impl->memory = std::make_unique<Ticker>(
      kGlanceAtProcess, [&log, &metrics = impl->context.metrics, free_memory = FreeMemory(),
                         counts = ConnectionCounts()]() mutable {
        log_connections(log, counts);
        const std::size_t bytes = give_back_free_memory(free_memory);
        if (bytes == 0) return;
        metrics.memory_given_back += bytes;
        log.write(LogLevel::kDebug, "memory_given_back", {{"bytes", std::uint64_t{bytes}}});
      });
  if (!config.metrics_listen.empty()) {
    Result<std::unique_ptr<Http>> http =
        Http::start(config.metrics_listen,
                    {[all = impl.get()] { return all->metrics(); },
                     [all = impl.get()] { return !all->context.lifecycle.draining(); },
                     [all = impl.get()] { return all->liveness.alive(std::chrono::steady_clock::now()); }});
    if (!http) {
      impl->server->Shutdown(std::chrono::system_clock::now());
      return http.error();
    }
    impl->http = std::move(http).value();
    const std::string address = with_port(config.metrics_listen, impl->http->port());
    log.write(LogLevel::kInfo, "metrics_listening", {{"address", address}});
    if (!is_local(config.metrics_listen))
      log.write(LogLevel::kWarning, "insecure",
                {{"address", address},
                 {"reason",
                  "others can reach this address and read the metrics, in the clear; let only "
                  "the monitoring's network through"}});
  }
  log.write(LogLevel::kInfo, "serving", {{"threads", std::int64_t{impl->context.workers->threads()}}});
  impl->health.serve();
  return std::unique_ptr<Daemon>(new Daemon(std::move(impl)));
}

Daemon::~Daemon() {
  impl_->http.reset();
  // Cancels what is in flight; the reactors end themselves when they hear of it.
  impl_->server->Shutdown(std::chrono::system_clock::now());
}

const std::vector<std::string>& Daemon::addresses() const {
  return impl_->addresses;
}

int Daemon::metrics_port() const {
  return impl_->http ? impl_->http->port() : 0;
}

bool Daemon::alive() const {
  return impl_->liveness.alive(std::chrono::steady_clock::now());
}

void Daemon::when_runner_moves(std::function<void()> task) {
  impl_->context.runner.post(std::move(task), Lane::kShort);
}

bool Daemon::reload() {
  auto& failures = impl_->context.metrics.reload_failures;
  Status reloaded = impl_->guard->reload();
  if (!reloaded) ++failures[Metrics::kTokenFile];
  if (impl_->certificates) {
    // Whatever became of the token file.
    const Status certificates = impl_->certificates->reload();
    if (!certificates) ++failures[Metrics::kCertificates];
    if (reloaded) reloaded = certificates;
  }
  impl_->set_quotas();
  // Who lost its rights loses its streams, too; whatever became of the rest.
  impl_->context.lifecycle.enforce_rights();
  impl_->context.log.write(reloaded ? LogLevel::kInfo : LogLevel::kError, "reloaded",
                           {{"ok", reloaded.ok()}, {"reason", reloaded ? "" : reloaded.error().message}});
  return reloaded.ok();
}

bool Daemon::drain() {
  const auto start = std::chrono::steady_clock::now();
  Context& context = impl_->context;
  context.log.write(LogLevel::kInfo, "draining",
                    {{"sessions", std::uint64_t{context.store.size()}},
                     {"timeout_ms", std::int64_t{impl_->drain_timeout.count()}}});
  impl_->health.stop();
  context.lifecycle.begin_drain(std::chrono::system_clock::now() + impl_->drain_timeout);
  // A client that has seen the notice stops sending and goes; one that has not is heard out while it sends,
  // for half of the time at most, so that what it sent before it could know is answered.
  const auto half = start + impl_->drain_timeout / 2;
  for (auto now = start; now < half; now = std::chrono::steady_clock::now()) {
    if (context.lifecycle.wait_until_idle(std::min(now + kGlance, half)) == 0) break;
    context.lifecycle.end_quiet_streams(kQuiet);
  }
  context.lifecycle.end_streams();
  // Steps that still run are given up, undone: their clients go on elsewhere, from the frame before.
  if (context.lifecycle.wait_until_idle(start + impl_->drain_timeout / 4 * 3) > 0) {
    for (const std::shared_ptr<Session>& session : context.store.list())
      session->close(Lifecycle::draining_fault());
    context.lifecycle.give_up_streams();
  }
  const std::size_t left = context.lifecycle.wait_until_idle(start + impl_->drain_timeout);
  impl_->server->Shutdown(std::chrono::system_clock::now() + kOthers);
  const auto took = std::chrono::steady_clock::now() - start;
  // Recordings end with their sessions, which go with the daemon.
  constexpr milliseconds kAtLeast{1000};
  if (context.recordings)
    context.recordings->finish_by(
        std::max(start + impl_->drain_timeout, std::chrono::steady_clock::now() + kAtLeast));
  context.log.write(left == 0 ? LogLevel::kInfo : LogLevel::kError, "drained",
                    {{"calls_cut_off", std::uint64_t{left}},
                     {"took_ms", std::int64_t{std::chrono::duration_cast<milliseconds>(took).count()}}});
  return left == 0;
}

}  // namespace warmfront::server
