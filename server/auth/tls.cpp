// SPDX-License-Identifier: Apache-2.0
// Checking certificates with OpenSSL, before gRPC sees them: it fails each handshake with what does not fit,
// and ends the process for an empty file. Thread-safe.
#include "server/auth/tls.h"

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "server/process/small_file.h"

namespace warmfront::server {
namespace {

template <class T, void (*kFree)(T*)>
struct Free {
  void operator()(T* it) const { kFree(it); }
};
using X509Pointer = std::unique_ptr<X509, Free<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY, EVP_PKEY_free>>;
using SslContext = std::unique_ptr<SSL_CTX, Free<SSL_CTX, SSL_CTX_free>>;
using Bio = std::unique_ptr<BIO, Free<BIO, BIO_free_all>>;

Error bad(const std::string& setting, const std::string& path, const std::string& what) {
  const char* reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  return invalid_argument(setting + " " + path + ": " + what +
                          (reason == nullptr ? "" : " (" + std::string(reason) + ")"));
}

/// A key under a password is none that serves: nobody is there to be asked.
int no_password(char*, int, int, void*) {
  return -1;
}

std::vector<X509Pointer> certificates_in(const std::string& pem) {
  std::vector<X509Pointer> certificates;
  const Bio bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  while (X509* one = PEM_read_bio_X509(bio.get(), nullptr, no_password, nullptr))
    certificates.emplace_back(one);
  // The end of the text is an error to OpenSSL; the first one was none.
  if (!certificates.empty()) ERR_clear_error();
  return certificates;
}

Key key_in(const std::string& pem) {
  const Bio bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  return Key(PEM_read_bio_PrivateKey(bio.get(), nullptr, no_password, nullptr));
}

std::time_t end_of(const std::vector<X509Pointer>& certificates) {
  std::time_t least = 0;
  for (const X509Pointer& one : certificates) {
    std::tm time{};
    if (ASN1_TIME_to_tm(X509_get0_notAfter(one.get()), &time) != 1) continue;
    const std::time_t end = ::timegm(&time);
    least = least == 0 ? end : std::min(least, end);
  }
  return least;
}

/// gRPC takes C strings.
Result<std::string> read_pem(const std::string& setting, const std::string& path) {
  Result<std::string> text = read_small_file(setting, path);
  if (text && text.value().find('\0') != std::string::npos)
    return invalid_argument(setting + " " + path + ": PEM is expected, which is text");
  return text;
}

}  // namespace

Result<TlsPem> read_tls_files(const TlsFiles& files) {
  if (files.certificate.empty() || files.key.empty())
    return invalid_argument("tls-cert and tls-key: both files are needed");
  Result<std::string> certificate = read_pem("tls-cert", files.certificate);
  if (!certificate) return certificate.error();
  Result<std::string> key = read_pem("tls-key", files.key);
  if (!key) return key.error();
  ERR_clear_error();
  const SslContext context(SSL_CTX_new(TLS_server_method()));
  if (!context) return Error{ErrorCode::kInternal, "OpenSSL: no context"};
  std::vector<X509Pointer> certificates = certificates_in(certificate.value());
  if (certificates.empty() || SSL_CTX_use_certificate(context.get(), certificates.front().get()) != 1)
    return bad("tls-cert", files.certificate, "no certificate in PEM that can be used is in it");
  const Key private_key = key_in(key.value());
  if (!private_key || SSL_CTX_use_PrivateKey(context.get(), private_key.get()) != 1)
    return bad("tls-key", files.key, "no key in PEM, without a password, that fits the certificate is in it");
  if (SSL_CTX_check_private_key(context.get()) != 1)
    return bad("tls-key", files.key, "it is not the key of the certificate");
  TlsPem pem{std::move(certificate).value(), std::move(key).value(), {}, 0};
  if (!files.client_ca.empty()) {
    Result<std::string> authorities = read_pem("tls-client-ca", files.client_ca);
    if (!authorities) return authorities.error();
    if (certificates_in(authorities.value()).empty())
      return bad("tls-client-ca", files.client_ca, "no certificate in PEM is in it");
    pem.client_ca = std::move(authorities).value();
  }
  pem.not_after = end_of(certificates);
  return pem;
}

}  // namespace warmfront::server
