// SPDX-License-Identifier: Apache-2.0
// HTTP by CivetWeb. Thread safety as stated in the header.
#include "server/observe/http.h"

#include <civetweb.h>

#include <array>
#include <atomic>
#include <chrono>
#include <exception>
#include <new>
#include <thread>
#include <utility>

#include "server/process/listen.h"

namespace warmfront::server {
namespace {

int answer(mg_connection* connection, int status, const char* type, const std::string& body) {
  mg_printf(connection,
            "HTTP/1.1 %d %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\nCache-Control: no-store\r\n"
            "Connection: close\r\n\r\n",
            status, status == 200 ? "OK" : "Service Unavailable", type, body.size());
  mg_write(connection, body.data(), body.size());
  return status;
}

constexpr const char* kText = "text/plain; charset=utf-8";

}  // namespace

struct Http::Impl {
  Pages pages;
  std::string host;  // as it was given
  mg_context* server = nullptr;
};

Http::Http(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

// CivetWeb looks whether it is to stop when someone connects, or every two seconds: so someone does. Without
// memory for a thread nobody does, and it stops later.
Http::~Http() {
  const int port = this->port();
  std::atomic<bool> stopped{false};
  std::thread stop;
  try {
    stop = std::thread([&] {
      mg_stop(impl_->server);
      stopped = true;
    });
  } catch (const std::exception&) {
    mg_stop(impl_->server);
    return;
  }
  while (!stopped) {
    std::array<char, 128> error{};
    mg_connection* knock = mg_connect_client(impl_->host.c_str(), port, 0, error.data(), error.size());
    if (knock != nullptr) mg_close_connection(knock);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  stop.join();
}

int Http::port() const {
  std::array<mg_server_port, 1> ports{};
  return mg_get_server_ports(impl_->server, 1, ports.data()) == 1 ? ports[0].port : 0;
}

Result<std::unique_ptr<Http>> Http::start(const std::string& address, Pages pages) {
  // Debian builds it without.
  if (address.starts_with('[') && mg_check_feature(MG_FEATURES_IPV6) == 0)
    return invalid_argument("metrics-listen " + address +
                            ": civetweb, as this system has it, knows no IPv6; an IPv4 host is expected");
  auto impl = std::make_unique<Impl>(Impl{std::move(pages), address.substr(0, address.rfind(':'))});
  // Many threads, which cost next to nothing while they wait, and short waits: who connects and says nothing
  // takes one for a second, and whoever checks the daemon's health meanwhile waits for two at most.
  const std::array<const char*, 9> options{"listening_ports",
                                           address.c_str(),
                                           "num_threads",
                                           "64",
                                           "request_timeout_ms",
                                           "1000",
                                           "enable_keep_alive",
                                           "no",
                                           nullptr};
  mg_callbacks callbacks{};
  callbacks.log_message = [](const mg_connection*, const char*) { return 1; };  // the reason is told below
  impl->server = mg_start(&callbacks, nullptr, const_cast<const char**>(options.data()));
  if (impl->server == nullptr)
    return Error{ErrorCode::kUnavailable, "metrics-listen " + address + ": " + why_not_bound(address)};
  Impl* const all = impl.get();
  mg_set_request_handler(
      all->server, "/metrics$",
      [](mg_connection* connection, void* data) {
        try {
          return answer(connection, 200, "text/plain; version=0.0.4; charset=utf-8",
                        static_cast<Impl*>(data)->pages.metrics());
        } catch (const std::bad_alloc&) {  // CivetWeb, which is C, cannot be left by it
          return answer(connection, 503, kText, "no memory\n");
        }
      },
      all);
  mg_set_request_handler(
      all->server, "/healthz$",
      [](mg_connection* connection, void* data) {
        const bool alive = static_cast<Impl*>(data)->pages.alive();
        return answer(connection, alive ? 200 : 503, kText, alive ? "ok\n" : "stuck\n");
      },
      all);
  mg_set_request_handler(
      all->server, "/readyz$",
      [](mg_connection* connection, void* data) {
        const bool ready = static_cast<Impl*>(data)->pages.ready();
        return answer(connection, ready ? 200 : 503, kText, ready ? "ready\n" : "draining\n");
      },
      all);
  return std::unique_ptr<Http>(new Http(std::move(impl)));
}

}  // namespace warmfront::server
