// SPDX-License-Identifier: Apache-2.0
// Files of a folder. Thread safety as stated in the header.
#include "server/transport/recordings.h"

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <utility>

namespace warmfront::server {
Result<std::shared_ptr<Recordings>> Recordings::open(const std::string& folder, std::uint64_t max_bytes,
                                                     Log& log, RecordingOptions options) {
  std::error_code code;
  if (!std::filesystem::is_directory(folder, code) || access(folder.c_str(), W_OK | X_OK) != 0)
    return invalid_argument("record-dir " + folder +
                            ": not a folder that this user may write to; make it first");
  std::uint64_t held = 0;
  for (std::filesystem::directory_iterator file(folder, code), end; !code && file != end;
       file.increment(code)) {
    if (file->path().extension() != ".wfrec") continue;
    std::error_code gone;
    const std::uintmax_t bytes = file->file_size(gone);
    if (!gone) held += bytes;
  }
  auto disk = std::make_shared<RecordingDisk>(std::move(options), max_bytes, held, log);
  return std::shared_ptr<Recordings>(new Recordings(folder, std::move(disk)));
}

std::shared_ptr<SessionRecording> Recordings::begin(const SessionId& session,
                                                    std::shared_ptr<Account> account) {
  const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::system_clock::now().time_since_epoch());
  std::shared_ptr<RecordingDisk::File> file =
      disk_->open(folder_ + "/" + session.text() + "-" + std::to_string(now.count()) + "-" +
                      std::to_string(++count_) + ".wfrec",
                  session.text(), std::move(account));
  if (!file) return nullptr;
  try {
    return std::make_shared<SessionRecording>(disk_, file);
  } catch (...) {
    disk_->close(file, false);
    throw;
  }
}

}  // namespace warmfront::server
