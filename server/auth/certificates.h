// SPDX-License-Identifier: Apache-2.0
// The certificates in force: read, proved, then swapped. Thread-safe.
#pragma once

#include <ctime>
#include <memory>
#include <string>
#include <utility>

#include "engine/result.h"
#include "server/annotations.h"
#include "server/auth/tls.h"
#include "server/log.h"
#include "server/process/memory_file.h"

namespace warmfront::server {

class Certificates {
 public:
  /// Fails as read_tls_files() does. `log` outlives it.
  static Result<std::shared_ptr<Certificates>> create(TlsFiles files, Log& log);

  /// Reads the files again. What cannot be used, or has expired where what serves has not, changes nothing.
  Status reload();
  /// Reads them again when they have changed since they were last read and then stood still from one call to
  /// the next: nobody replaces two files at once. To be called every half second or so; says in the log what
  /// came of it, once for each change, and once a day of a certificate that expires within two weeks. False
  /// when they were read and could not be used.
  bool look();

  /// When what is in force expires.
  std::time_t expiry() const;

  /// Files of this process that hold what is in force, always whole and proved: one of certificate and key,
  /// whose two halves can never be of different pairs, and one of the client CA, if there is one.
  TlsFiles in_force() const;

 private:
  Certificates(TlsFiles files, Log& log) : files_(std::move(files)), log_(log) {}
  /// Whether what serves was swapped.
  Result<bool> read();
  void warn_of_the_end();

  // Constant after construction.
  const TlsFiles files_;
  Log& log_;

  // Protected by mutex_.
  mutable Mutex mutex_;
  TlsPem in_force_ WARMFRONT_GUARDED_BY(mutex_);
  std::unique_ptr<MemoryFile> pair_ WARMFRONT_GUARDED_BY(mutex_);
  std::unique_ptr<MemoryFile> client_ca_ WARMFRONT_GUARDED_BY(mutex_);  // null: clients need none
  std::string read_ WARMFRONT_GUARDED_BY(mutex_);    // how the files looked when they were last read
  std::string looked_ WARMFRONT_GUARDED_BY(mutex_);  // and at the last look
  std::time_t warned_ WARMFRONT_GUARDED_BY(mutex_) = 0;
};

}  // namespace warmfront::server
