// SPDX-License-Identifier: Apache-2.0
// Reading by file descriptor, which looks before it reads. Thread safety as stated in the header.
#include "server/process/small_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <thread>
#include <tuple>

namespace warmfront::server {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20;
constexpr std::chrono::milliseconds kPatience{2000};
/// One who writes a file in pieces is given this long between two of them.
constexpr std::chrono::milliseconds kPause{50};

class File {
 public:
  // A pipe without a writer is not waited for.
  explicit File(const std::string& path) : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
  ~File() {
    if (file_ >= 0) ::close(file_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int get() const { return file_; }

 private:
  const int file_;
};

struct Reading {
  std::string text;
  struct stat status {};
};

Result<Reading> read_once(const std::string& where, const std::string& path) {
  const auto unreadable = [&] {
    return invalid_argument(where + "it cannot be read (" + std::strerror(errno) + ")");
  };
  const File file(path);
  Reading reading;
  if (file.get() < 0 || ::fstat(file.get(), &reading.status) != 0) return unreadable();
  if (!S_ISREG(reading.status.st_mode))
    return invalid_argument(where + "it cannot be read: a regular file is expected");
  for (;;) {
    constexpr std::size_t kBlock = 16 << 10;
    const std::size_t before = reading.text.size();
    if (before > kMostBytes)
      return invalid_argument(where + "a file of at most " + std::to_string(kMostBytes) +
                              " bytes is expected");
    reading.text.resize(before + kBlock);
    const ssize_t got = ::read(file.get(), reading.text.data() + before, kBlock);
    if (got < 0 && errno != EINTR) return unreadable();
    reading.text.resize(before + static_cast<std::size_t>(got < 0 ? 0 : got));
    if (got == 0) return reading;
  }
}

auto identity(const struct stat& status) {
  return std::tuple(status.st_dev, status.st_ino, status.st_size, status.st_mtim.tv_sec,
                    status.st_mtim.tv_nsec);
}

/// Whether it was written to a moment ago: more may come.
bool fresh(const struct stat& status) {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  const auto ns = [](const timespec& t) {
    return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
  };
  const auto age = ns(now) - ns(status.st_mtim);
  return age >= std::chrono::nanoseconds(0) && age < kPause;
}

}  // namespace

Result<std::string> read_small_file(const std::string& what, const std::string& path) {
  const std::string where = what + " " + path + ": ";
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  std::optional<Reading> before;
  for (;;) {
    Result<Reading> reading = read_once(where, path);
    if (!reading) return reading.error();
    const bool same = before && identity(before->status) == identity(reading.value().status) &&
                      before->text == reading.value().text;
    if (same || (!before && !fresh(reading.value().status))) return std::move(reading.value().text);
    if (std::chrono::steady_clock::now() >= deadline)
      return Error{ErrorCode::kUnavailable,
                   where + "it is being written to all the time; write another file and rename it to this"};
    before = std::move(reading).value();
    std::this_thread::sleep_for(kPause);
  }
}

bool is_readable_by_others(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && (status.st_mode & S_IROTH) != 0;
}

}  // namespace warmfront::server
