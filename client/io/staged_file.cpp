// SPDX-License-Identifier: Apache-2.0
#include "client/io/staged_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <map>
#include <mutex>
#include <system_error>
#include <vector>

namespace warmfront::client {

namespace fs = std::filesystem;

namespace {

/// The folders that there are, and the file that each is for. Never destroyed: remove_all() may come while
/// the process ends.
struct Staged {
  std::mutex mutex;
  std::map<fs::path, fs::path> targets;
};
Staged& staged_now() {
  static auto* const all = new Staged;
  return *all;
}

/// Six characters of mkdtemp() behind it. It says whose it is: what is abandoned is removed.
std::string folder_prefix(const fs::path& target) {
  return "." + target.filename().string() + ".warmfront-";
}

/// A descriptor that holds the folder's lock, which its process has until it ends; -1 where another one has
/// it or the file system has none. Not passed on to programs that are started. `wait`: 0, or LOCK_NB.
int lock_folder(const fs::path& folder, int wait) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0 || ::flock(descriptor, LOCK_EX | wait) == 0) return descriptor;
  ::close(descriptor);
  return -1;
}

bool is_folder_of_mine(const fs::path& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == ::geteuid();
}

/// Removes what processes left that were killed while they wrote this file: folders that nobody has locked.
void remove_abandoned(const fs::path& parent, const fs::path& target) {
  constexpr std::size_t kRandom = 6;
  const std::string prefix = folder_prefix(target);
  std::error_code code;
  std::vector<fs::path> abandoned;
  for (fs::directory_iterator at(parent, code), end; !code && at != end; at.increment(code)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with(prefix) && name.size() == prefix.size() + kRandom && is_folder_of_mine(at->path()))
      abandoned.push_back(at->path());
  }
  for (const fs::path& folder : abandoned) {
    const int lock = lock_folder(folder, LOCK_NB);
    if (lock < 0) continue;
    fs::remove_all(folder, code);
    ::close(lock);
  }
}

}  // namespace

std::vector<std::string> StagedFile::remove_all() {
  Staged& all = staged_now();
  all.mutex.lock();  // for good
  std::vector<std::string> targets;
  for (const auto& [folder, target] : all.targets) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    targets.push_back(target.string());
  }
  return targets;
}

Result<StagedFile> StagedFile::create(const std::string& path) {
  StagedFile staged;
  staged.path_ = path;
  std::error_code code;
  if (path == "-" || (fs::exists(path, code) && !fs::is_regular_file(path, code))) return staged;
  staged.target_ = fs::is_symlink(path, code) ? fs::weakly_canonical(path, code) : fs::path(path);
  const fs::path parent = staged.target_.has_parent_path() ? staged.target_.parent_path() : fs::path(".");
  if (fs::exists(staged.target_, code) &&
      ::faccessat(AT_FDCWD, staged.target_.c_str(), W_OK, AT_EACCESS) != 0)
    return invalid_argument(path + ": cannot write: " + std::generic_category().message(errno));
  Staged& all = staged_now();
  const std::lock_guard lock(all.mutex);
  remove_abandoned(parent, staged.target_);
  // Between making a folder and locking it another process may take it for abandoned: then another one is
  // made.
  do {
    std::string folder = (parent / (folder_prefix(staged.target_) + "XXXXXX")).string();
    if (mkdtemp(folder.data()) == nullptr)
      return invalid_argument(path + ": cannot write beside it: " + std::generic_category().message(errno));
    if (staged.lock_ >= 0) ::close(staged.lock_);
    staged.lock_ = lock_folder(folder, 0);
    staged.folder_ = folder;
  } while (!fs::exists(staged.folder_, code));
  all.targets.emplace(staged.folder_, staged.target_);
  staged.path_ = (staged.folder_ / staged.target_.filename()).string();
  return staged;
}

StagedFile::~StagedFile() {
  if (folder_.empty()) return;
  Staged& all = staged_now();
  const std::lock_guard lock(all.mutex);
  all.targets.erase(folder_);
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

Status StagedFile::commit() {
  if (folder_.empty()) return {};
  const std::lock_guard lock(staged_now().mutex);
  std::error_code code;
  std::vector<fs::path> names;
  for (fs::directory_iterator at(folder_, code), end; !code && at != end; at.increment(code))
    names.push_back(at->path().filename());
  // NAME.pvd is behind NAME_000001.vtp and all others: '.' is below '_'.
  std::ranges::sort(names, std::greater<>{});
  for (const fs::path& name : names) {
    const fs::path to = target_.parent_path() / name;
    std::error_code none;
    if (const fs::file_status old = fs::status(to, none); fs::is_regular_file(old))
      fs::permissions(folder_ / name, old.permissions(), none);
    if (!code) fs::rename(folder_ / name, to, code);
    if (code) break;
  }
  if (code) return invalid_argument(target_.string() + ": cannot write: " + code.message());
  return {};
}

}  // namespace warmfront::client
