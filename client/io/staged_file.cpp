// SPDX-License-Identifier: Apache-2.0
#include "client/io/staged_file.h"

#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <mutex>
#include <set>
#include <system_error>
#include <vector>

namespace warmfront::client {

namespace fs = std::filesystem;

namespace {

/// The folders that there are. Never destroyed: remove_all() may come while the process ends.
struct Staged {
  std::mutex mutex;
  std::set<fs::path> folders;
};
Staged& staged_now() {
  static auto* const all = new Staged;
  return *all;
}

}  // namespace

void StagedFile::remove_all() noexcept {
  Staged& all = staged_now();
  all.mutex.lock();  // for good
  for (const fs::path& folder : all.folders) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
}

Result<StagedFile> StagedFile::create(const std::string& path) {
  StagedFile staged;
  staged.path_ = path;
  std::error_code code;
  if (path == "-" || (fs::exists(path, code) && !fs::is_regular_file(path, code))) return staged;
  staged.target_ = fs::is_symlink(path, code) ? fs::weakly_canonical(path, code) : fs::path(path);
  const fs::path parent = staged.target_.has_parent_path() ? staged.target_.parent_path() : fs::path(".");
  std::string folder = (parent / ("." + staged.target_.filename().string() + ".XXXXXX")).string();
  Staged& all = staged_now();
  const std::lock_guard lock(all.mutex);
  if (mkdtemp(folder.data()) == nullptr)
    return invalid_argument(path + ": cannot write beside it: " + std::generic_category().message(errno));
  staged.folder_ = folder;
  all.folders.insert(staged.folder_);
  staged.path_ = (staged.folder_ / staged.target_.filename()).string();
  return staged;
}

StagedFile::~StagedFile() {
  if (folder_.empty()) return;
  Staged& all = staged_now();
  const std::lock_guard lock(all.mutex);
  all.folders.erase(folder_);
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
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
