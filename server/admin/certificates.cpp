// SPDX-License-Identifier: Apache-2.0
// Watching certificate files. Thread safety as stated in the header.
#include "server/admin/certificates.h"

#include <sys/stat.h>

#include <utility>

namespace warmfront::server {
namespace {

constexpr std::time_t kDay = 24 * 60 * 60;
constexpr std::time_t kSoon = 14 * kDay;

/// Another text when a file was written to or replaced.
std::string look_of(const TlsFiles& files) {
  std::string text;
  for (const std::string* path : {&files.certificate, &files.key, &files.client_ca}) {
    struct stat status {};
    if (path->empty() || ::stat(path->c_str(), &status) != 0) {
      text += "none;";
      continue;
    }
    text.append(std::to_string(status.st_dev)).append(" ").append(std::to_string(status.st_ino));
    text.append(" ").append(std::to_string(status.st_size));
    text.append(" ").append(std::to_string(status.st_mtim.tv_sec));
    text.append(" ").append(std::to_string(status.st_mtim.tv_nsec)).append(";");
  }
  return text;
}

}  // namespace

Result<std::shared_ptr<Certificates>> Certificates::create(TlsFiles files, Log& log) {
  std::shared_ptr<Certificates> certificates(new Certificates(std::move(files), log));
  if (const Status read = certificates->read(); !read) return read.error();
  certificates->warn_of_the_end();
  return certificates;
}

Status Certificates::read() {
  std::string look = look_of(files_);
  {
    const MutexLock lock(mutex_);
    read_ = looked_ = std::move(look);
  }
  Result<TlsPem> read = read_tls_files(files_);
  if (!read) return read.error();
  auto pem = std::make_shared<const TlsPem>(std::move(read).value());
  const std::time_t now = ::time(nullptr);
  const MutexLock lock(mutex_);
  const TlsPem* before = in_force_.pem.get();
  if (before != nullptr && pem->not_after <= now && before->not_after > now)
    return invalid_argument("tls-cert " + files_.certificate +
                            ": it has expired, and what is in force has not");
  if (before != nullptr && before->certificate == pem->certificate && before->key == pem->key &&
      before->client_ca == pem->client_ca)
    return {};
  in_force_ = {std::move(pem), in_force_.number + 1};
  warned_ = 0;
  return {};
}

Status Certificates::reload() {
  Status status = read();
  if (status) warn_of_the_end();
  return status;
}

void Certificates::look() {
  std::string look = look_of(files_);
  std::uint64_t before = 0;
  {
    const MutexLock lock(mutex_);
    const bool still = look == looked_;
    looked_ = std::move(look);
    before = in_force_.number;
    if (looked_ == read_ || !still) before = 0;
  }
  if (before != 0) {
    const Status status = read();
    const bool swapped = in_force().number != before;
    if (!status || swapped)
      log_.write(status ? LogLevel::kInfo : LogLevel::kError, "certificates",
                 {{"swapped", swapped},
                  {"reason", status ? "the files changed"
                                    : status.error().message + "; what was in force before still serves"}});
  }
  warn_of_the_end();
}

void Certificates::warn_of_the_end() {
  const std::time_t now = ::time(nullptr);
  std::time_t end = 0;
  {
    const MutexLock lock(mutex_);
    end = in_force_.pem->not_after;
    if (end == 0 || end - now > kSoon || now - warned_ < kDay) return;
    warned_ = now;
  }
  log_.write(LogLevel::kWarning, "certificate_expires",
             {{"file", files_.certificate},
              {"hours_left", std::int64_t{(end - now) / 3600}},
              {"reason", end <= now ? "it has expired: clients refuse it; replace the files"
                                    : "clients will refuse it then; replace the files"}});
}

Certificates::InForce Certificates::in_force() const {
  const MutexLock lock(mutex_);
  return in_force_;
}

}  // namespace warmfront::server
