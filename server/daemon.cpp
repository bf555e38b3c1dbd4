// SPDX-License-Identifier: Apache-2.0
// Starting, serving, draining, each as a list of calls. Thread safety as stated in the header.
#include "server/daemon.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <utility>

#include "server/grpc_server.h"
#include "server/observe/http.h"
#include "server/observe/liveness.h"
#include "server/observe/metrics_text.h"
#include "server/periodic.h"
#include "server/process/accept.h"
#include "server/process/listen.h"
#include "server/startup.h"
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
/// How long calls of other services (health watches, reflection) get to end by themselves.
constexpr milliseconds kOthers{200};

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
  std::unique_ptr<MemoryDesk> memory_desk;  // its threads carry out what streams ask for
  std::unique_ptr<Http> http;

  // In the order of start().

  Status record(const Config& config) {
    if (config.record_dir.empty()) return {};
    auto recordings =
        Recordings::open(config.record_dir, config.record_max_bytes, context.log,
                         {.queue_bytes = config.record_queue_bytes, .flush_timeout = config.drain_timeout});
    if (!recordings) return recordings.error();
    context.recordings = std::move(recordings).value();
    return {};
  }

  Status audit(const Config& config) {
    Result<std::unique_ptr<Audit>> audit = Audit::open(config.audit_file, context.log);
    if (!audit) return audit.error();
    context.audit = std::move(audit).value();
    return {};
  }

  Status trace(const Config& config) {
    if (!config.trace.enabled()) return {};
    auto tracer = Tracer::start(config.trace, [&log = context.log](const std::string& why) {
      log.write(LogLevel::kWarning, "traces_lost", {{"reason", why}});
    });
    if (!tracer) return tracer.error();
    context.tracer = std::move(tracer).value();
    return {};
  }

  /// Without it clients go on over their sockets.
  void share_memory(const Config& config) {
    std::vector<std::string> paths;
    for (const std::string& address : config.listen)
      if (std::optional<std::string> path = unix_path(address)) paths.push_back(*std::move(path));
    if (config.no_shared_memory || paths.empty()) return;
    Result<std::unique_ptr<MemoryDesk>> desk = MemoryDesk::start(
        paths, context.packet_threads(), std::chrono::microseconds(config.spin_microseconds));
    if (!desk) {
      context.log.write(LogLevel::kWarning, "no_shared_memory", {{"reason", desk.error().message}});
      return;
    }
    memory_desk = std::move(desk).value();
    context.memory_desk = memory_desk.get();
  }

  Status serve(const Config& config) {
    service = make_collision_service(context);
    admin_service = make_admin_service(context);
    std::optional<TlsFiles> files;
    if (certificates) {
      files = certificates->in_force();
      certificate_files = watch_certificates(certificates, context.metrics);
    }
    const std::array<grpc::Service*, 3> services{service.get(), admin_service.get(), &health};
    Result<ListeningServer> listening = listen_and_serve(config, files ? &*files : nullptr, services);
    if (!listening) return listening.error();
    server = std::move(listening.value().server);
    addresses = std::move(listening.value().addresses);
    for (std::size_t i = 0; i < addresses.size(); ++i) log_address(config, config.listen[i], addresses[i]);
    return {};
  }

  /// `wanted`: without the port that was chosen for it.
  void log_address(const Config& config, const std::string& wanted, const std::string& address) {
    const bool is_encrypted = uses_tls(wanted, config.tls);
    context.log.write(
        LogLevel::kInfo, "listening",
        {{"address", address}, {"encrypted", is_encrypted}, {"authenticated", guard->authenticates()}});
    if (is_local(wanted) || (is_encrypted && guard->authenticates())) return;
    context.log.write(
        LogLevel::kWarning, "insecure",
        {{"address", address},
         {"reason", is_encrypted
                        ? "whoever reaches this address may call; set --token-file or --tls-client-ca"
                        : "others can reach this address and nothing is encrypted"}});
  }

  void begin_periodic_work() {
    expiry = expire_sessions(context);
    timeouts = enforce_timeouts(context, [this] { beat(); });
    memory = look_after_process(context);
  }

  Status serve_metrics(const Config& config) {
    if (config.metrics_listen.empty()) return {};
    Result<std::unique_ptr<Http>> started =
        Http::start(config.metrics_listen,
                    {[this] { return metrics(); }, [this] { return !context.lifecycle.draining(); },
                     [this] { return liveness.alive(std::chrono::steady_clock::now()); }});
    if (!started) {
      server->Shutdown(std::chrono::system_clock::now());
      return started.error();
    }
    http = std::move(started).value();
    const std::string address = with_port(config.metrics_listen, http->port());
    context.log.write(LogLevel::kInfo, "metrics_listening", {{"address", address}});
    if (!is_local(config.metrics_listen))
      context.log.write(LogLevel::kWarning, "insecure",
                        {{"address", address},
                         {"reason",
                          "others can reach this address and read the metrics, in the clear; let only "
                          "the monitoring's network through"}});
    return {};
  }

  // While it serves.

  /// The token file's words go before the configuration's.
  void set_quotas() {
    warn_of_principals_without_token(context.log, guard->without_token(quotas));
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
                         tenant->steps.load(), 1e-9 * static_cast<double>(tenant->step_nanoseconds.load()),
                         tenant->quota()});
    return metrics_text(context.metrics,
                        {.sessions = context.store.size(),
                         .charged_bytes = context.budget.used(),
                         .max_bytes = context.budget.limit(),
                         .open_streams = context.streams.inside(),
                         .frames_in_flight = context.frames.inside(),
                         .shared_bytes = context.shared_bytes.load(),
                         .threads = static_cast<std::uint64_t>(context.workers->threads()),
                         .draining = context.lifecycle.draining(),
                         .certificate_expiry = certificates ? certificates->expiry() : 0,
                         .traced_sent = context.tracer ? context.tracer->frames_sent() : 0,
                         .traced_dropped = context.tracer ? context.tracer->frames_dropped() : 0,
                         .tenants = std::move(tenants)});
  }
};

Daemon::Daemon(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<Daemon>> Daemon::start(const Config& wanted, Log& log) {
  Config config = wanted;
  Result<std::vector<SocketLock>> sockets = lock_addresses(config);
  if (!sockets) return sockets.error();
  Result<std::unique_ptr<Guard>> guard =
      Guard::create({config.token_file, !config.tls.client_ca.empty(), config.admins});
  if (!guard) return guard.error();
  Result<Quotas> quotas = parse_quotas(config.quotas);
  if (!quotas) return quotas.error();
  Result<std::shared_ptr<Certificates>> certificates = certificates_of(config, log);
  if (!certificates) return certificates.error();
  warn_of_readable_secrets(log, config);
  warn_of_slow_instructions(log);
  for (const std::string& reason : fit_to_memory(config.limits))
    log.write(LogLevel::kWarning, "limits_beside_memory", {{"reason", reason}});
  enable_plugins(config.reflection, config.channelz);
  refuse_connections_without_files();
  auto impl = std::make_unique<Impl>(config, log, std::move(guard).value(), std::move(certificates).value(),
                                     std::move(quotas).value());
  impl->sockets = std::move(sockets).value();
  impl->set_quotas();
  if (Status recording = impl->record(config); !recording) return recording.error();
  if (Status auditing = impl->audit(config); !auditing) return auditing.error();
  if (Status tracing = impl->trace(config); !tracing) return tracing.error();
  impl->share_memory(config);
  if (Status serving = impl->serve(config); !serving) return serving.error();
  impl->begin_periodic_work();
  if (Status served = impl->serve_metrics(config); !served) return served.error();
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
                           {{"ok", reloaded.ok()},
                            {"read", what_is_read_again(*impl_->guard, impl_->certificates != nullptr)},
                            {"reason", reloaded ? "" : reloaded.error().message}});
  impl_->context.audit->record({.action = "reload",
                                .principal = "signal",
                                .code = reloaded ? 0 : to_grpc_code(reloaded.error().code),
                                .reason = reloaded ? "" : reloaded.error().message});
  return reloaded.ok();
}

bool Daemon::drain() {
  const auto start = std::chrono::steady_clock::now();
  Context& context = impl_->context;
  context.log.write(LogLevel::kInfo, "draining",
                    {{"sessions", std::uint64_t{context.store.size()}},
                     {"timeout_ms", std::int64_t{impl_->drain_timeout.count()}}});
  context.audit->record({.action = "drain", .principal = "signal"});
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
  const std::size_t given_up = context.lifecycle.wait_until_idle(start + impl_->drain_timeout / 4 * 3);
  if (given_up > 0) {
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
                     {"calls_given_up", std::uint64_t{given_up}},
                     {"took_ms", std::int64_t{std::chrono::duration_cast<milliseconds>(took).count()}}});
  return left == 0;
}

}  // namespace warmfront::server
