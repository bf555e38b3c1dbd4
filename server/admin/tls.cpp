// SPDX-License-Identifier: Apache-2.0
// Checking certificates with OpenSSL: gRPC itself would only fail each handshake. Thread-safe.
#include "server/admin/tls.h"

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <memory>

namespace warmfront::server {
namespace {

Error bad(const std::string& setting, const std::string& path, const std::string& what) {
  const char* reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  return invalid_argument(setting + " " + path + ": " + what +
                          (reason == nullptr ? "" : " (" + std::string(reason) + ")"));
}

}  // namespace

Status check_tls_files(const TlsFiles& files) {
  if (files.certificate.empty() || files.key.empty())
    return invalid_argument("tls-cert and tls-key: both files are needed");
  ERR_clear_error();
  const std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
  if (!context) return Error{ErrorCode::kInternal, "OpenSSL: no context"};
  if (SSL_CTX_use_certificate_chain_file(context.get(), files.certificate.c_str()) != 1)
    return bad("tls-cert", files.certificate, "no certificate in PEM can be read");
  if (SSL_CTX_use_PrivateKey_file(context.get(), files.key.c_str(), SSL_FILETYPE_PEM) != 1)
    return bad("tls-key", files.key, "no key in PEM that fits the certificate can be read");
  if (SSL_CTX_check_private_key(context.get()) != 1)
    return bad("tls-key", files.key, "it is not the key of the certificate");
  if (!files.client_ca.empty() &&
      SSL_CTX_load_verify_locations(context.get(), files.client_ca.c_str(), nullptr) != 1)
    return bad("tls-client-ca", files.client_ca, "no certificate in PEM can be read");
  return {};
}

}  // namespace warmfront::server
