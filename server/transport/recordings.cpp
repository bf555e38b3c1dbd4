// SPDX-License-Identifier: Apache-2.0
// Files of a folder. Thread safety as stated in the header.
#include "server/transport/recordings.h"

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <utility>

#include "server/version.h"

namespace warmfront::server {
namespace {

/// Kept back for the marker at the end of each recording, which must fit whatever happened before.
constexpr std::uint64_t kMarkerBytes = 512;

}  // namespace

Result<std::shared_ptr<Recordings>> Recordings::open(const std::string& folder, std::uint64_t max_bytes,
                                                     Log& log) {
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
  return std::shared_ptr<Recordings>(new Recordings(folder, max_bytes, held, log));
}

std::shared_ptr<SessionRecording> Recordings::begin(const std::shared_ptr<Recordings>& recordings,
                                                    const SessionId& session) {
  const auto refuse = [&](const std::string& reason) {
    recordings->log_.write(LogLevel::kWarning, "recording_refused",
                           {{"session", session.text()}, {"reason", reason}});
    return nullptr;
  };
  if (!recordings->held_.try_take(kMarkerBytes))
    return refuse("the folder holds --record-max-bytes; remove recordings and restart, or raise it");
  const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::system_clock::now().time_since_epoch());
  const std::string path = recordings->folder_ + "/" + session.text() + "-" + std::to_string(now.count()) +
                           "-" + std::to_string(++recordings->count_) + ".wfrec";
  auto writer = recording::Writer::create(
      path, std::string("warmfrontd ") + kVersion,
      {.admit = [recordings](std::size_t bytes) { return recordings->held_.try_take(bytes); },
       .give_back = [recordings](std::size_t bytes) { recordings->held_.give(kMarkerBytes + bytes); },
       .stopped =
           [recordings, path](const std::string& reason) {
             recordings->log_.write(LogLevel::kWarning, "recording_stopped",
                                    {{"file", path}, {"reason", reason}});
           }});
  if (!writer) {
    recordings->held_.give(kMarkerBytes);
    return refuse(writer.error().message);
  }
  recordings->log_.write(LogLevel::kInfo, "recording", {{"session", session.text()}, {"file", path}});
  return std::make_shared<SessionRecording>(std::move(writer).value());
}

}  // namespace warmfront::server
