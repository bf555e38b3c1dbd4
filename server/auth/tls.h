// SPDX-License-Identifier: Apache-2.0
// Certificates from files. Thread-safe.
#pragma once

#include <ctime>
#include <string>

#include "engine/result.h"

namespace warmfront::server {

/// PEM files; all empty: no TLS.
struct TlsFiles {
  std::string certificate;  ///< the daemon's, with the chain after it
  std::string key;          ///< of that certificate
  std::string client_ca;    ///< who signs clients' certificates; with it each client must show one

  bool enabled() const { return !certificate.empty() || !key.empty() || !client_ca.empty(); }
};

/// What they hold, proved to serve: a certificate, its key, and at least one certificate of a client CA where
/// one is asked for.
struct TlsPem {
  std::string certificate;
  std::string key;
  std::string client_ca;      ///< empty: clients need none
  std::time_t not_after = 0;  ///< when the first of all these expires
};

/// Reads each file once and checks what was read, so that what is checked is what serves. INVALID_ARGUMENT
/// unless certificate and key are both given, can be read and belong together, and the client CA, if given,
/// can be read. The message names the file.
Result<TlsPem> read_tls_files(const TlsFiles& files);

}  // namespace warmfront::server
