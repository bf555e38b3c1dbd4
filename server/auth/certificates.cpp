// SPDX-License-Identifier: Apache-2.0
// Watching certificate files. Thread safety as stated in the header.
#include "server/auth/certificates.h"

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

/// Puts a text where gRPC reads it, first or again.
Status put(const std::string& text, std::unique_ptr<MemoryFile>& file) {
  if (file) return file->replace(text);
  Result<std::unique_ptr<MemoryFile>> made = MemoryFile::create(text);
  if (!made) return made.error();
  file = std::move(made).value();
  return {};
}

}  // namespace

Result<std::shared_ptr<Certificates>> Certificates::create(TlsFiles files, Log& log) {
  std::shared_ptr<Certificates> certificates(new Certificates(std::move(files), log));
  if (const Result<bool> read = certificates->read(); !read) return read.error();
  certificates->warn_of_the_end();
  return certificates;
}

Result<bool> Certificates::read() {
  std::string look = look_of(files_);
  {
    const MutexLock lock(mutex_);
    read_ = looked_ = std::move(look);
  }
  Result<TlsPem> read = read_tls_files(files_);
  if (!read) return read.error();
  TlsPem pem = std::move(read).value();
  const std::time_t now = ::time(nullptr);
  const MutexLock lock(mutex_);
  if (pair_ && pem.not_after <= now && in_force_.not_after > now)
    return invalid_argument("tls-cert " + files_.certificate +
                            ": it has expired, and what is in force has not");
  if (in_force_.certificate == pem.certificate && in_force_.key == pem.key &&
      in_force_.client_ca == pem.client_ca)
    return false;
  if (!pem.client_ca.empty())
    if (const Status status = put(pem.client_ca, client_ca_); !status) return status.error();
  if (const Status status = put(pem.key + "\n" + pem.certificate, pair_); !status) return status.error();
  in_force_ = std::move(pem);
  warned_ = 0;
  return true;
}

Status Certificates::reload() {
  const Result<bool> swapped = read();
  if (!swapped) return swapped.error();
  warn_of_the_end();
  return {};
}

bool Certificates::look() {
  std::string look = look_of(files_);
  const bool due = [&] {
    const MutexLock lock(mutex_);
    const bool still = look == looked_;
    looked_ = std::move(look);
    return still && looked_ != read_;
  }();
  bool usable = true;
  if (due) {
    const Result<bool> swapped = read();
    usable = swapped.ok();
    if (!swapped)
      log_.write(LogLevel::kError, "certificates",
                 {{"swapped", false},
                  {"reason", swapped.error().message + "; what was in force before still serves"}});
    else if (swapped.value())
      log_.write(LogLevel::kInfo, "certificates", {{"swapped", true}, {"reason", "the files changed"}});
  }
  warn_of_the_end();
  return usable;
}

std::time_t Certificates::expiry() const {
  const MutexLock lock(mutex_);
  return in_force_.not_after;
}

void Certificates::warn_of_the_end() {
  const std::time_t now = ::time(nullptr);
  std::time_t end = 0;
  {
    const MutexLock lock(mutex_);
    end = in_force_.not_after;
    if (end == 0 || end - now > kSoon || now - warned_ < kDay) return;
    warned_ = now;
  }
  log_.write(LogLevel::kWarning, "certificate_expires",
             {{"file", files_.certificate},
              {"hours_left", std::int64_t{(end - now) / 3600}},
              {"reason", end <= now ? "it has expired: clients refuse it; replace the files"
                                    : "clients will refuse it then; replace the files"}});
}

TlsFiles Certificates::in_force() const {
  const MutexLock lock(mutex_);
  return {pair_->path(), pair_->path(), client_ca_ ? client_ca_->path() : std::string()};
}

}  // namespace warmfront::server
