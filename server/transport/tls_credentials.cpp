// SPDX-License-Identifier: Apache-2.0
// Server credentials over gRPC's C interface, the only one that asks for certificates at each handshake
// (grpc_ssl_server_credentials_create_options_using_config_fetcher in grpc_security.h). Thread safety as
// stated in the header.
#include "server/transport/tls_credentials.h"

#include <grpc/grpc_security.h>
#include <grpcpp/security/auth_metadata_processor.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <utility>

#include "server/annotations.h"

namespace warmfront::server {
namespace {

/// What one listener of gRPC's was handed last.
struct Listener {
  explicit Listener(const Certificates& the_certificates) : certificates(the_certificates) {}

  const Certificates& certificates;
  std::atomic<std::uint64_t> handed{0};
};

grpc_ssl_certificate_config_reload_status fetch(void* data, grpc_ssl_server_certificate_config** config) {
  auto& listener = *static_cast<Listener*>(data);
  try {
    const Certificates::InForce in_force = listener.certificates.in_force();
    if (listener.handed == in_force.number) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair pair{in_force.pem->key.c_str(), in_force.pem->certificate.c_str()};
    // Debian's gRPC asserts that there are roots, also where no client is asked for a certificate.
    const std::string& roots =
        in_force.pem->client_ca.empty() ? in_force.pem->certificate : in_force.pem->client_ca;
    *config = grpc_ssl_server_certificate_config_create(roots.c_str(), &pair, 1);
    listener.handed = in_force.number;
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  } catch (...) {
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_FAIL;  // what it has goes on serving
  }
}

class TlsCredentials final : public grpc::ServerCredentials {
 public:
  explicit TlsCredentials(std::shared_ptr<Certificates> certificates)
      : certificates_(std::move(certificates)) {}
  ~TlsCredentials() override = default;

  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  // Called by ServerBuilder::BuildAndStart(). The listener is used until the server has shut down, which the
  // server's owner sees to before it lets go of this.
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    Listener& listener = listeners_.emplace_back(*certificates_);
    const bool ask = !certificates_->in_force().pem->client_ca.empty();
    grpc_ssl_server_credentials_options* options =
        grpc_ssl_server_credentials_create_options_using_config_fetcher(
            ask ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE,
            fetch, &listener);
    grpc_server_credentials* credentials = grpc_ssl_server_credentials_create_with_options(options);
    const int port = grpc_server_add_http2_port(server, address.c_str(), credentials);
    grpc_server_credentials_release(credentials);
    return port;
  }

  const std::shared_ptr<Certificates> certificates_;
  std::deque<Listener> listeners_;  // whose addresses last
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> tls_credentials(std::shared_ptr<Certificates> certificates) {
  return std::make_shared<TlsCredentials>(std::move(certificates));
}

}  // namespace warmfront::server
