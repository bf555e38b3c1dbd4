// SPDX-License-Identifier: Apache-2.0
// Certificates from files. Thread-safe.
#pragma once

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

/// INVALID_ARGUMENT unless certificate and key are both given, can be read and belong together, and the
/// client CA, if given, can be read. The message names the file.
Status check_tls_files(const TlsFiles& files);

}  // namespace warmfront::server
