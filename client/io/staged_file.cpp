// SPDX-License-Identifier: Apache-2.0
#include "client/io/staged_file.h"

#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <system_error>
#include <vector>

namespace warmfront::client {

namespace fs = std::filesystem;

Result<StagedFile> StagedFile::create(const std::string& path) {
  StagedFile staged;
  staged.path_ = path;
  std::error_code code;
  if (path == "-" || (fs::exists(path, code) && !fs::is_regular_file(path, code))) return staged;
  staged.target_ = fs::is_symlink(path, code) ? fs::weakly_canonical(path, code) : fs::path(path);
  const fs::path parent = staged.target_.has_parent_path() ? staged.target_.parent_path() : fs::path(".");
  std::string folder = (parent / ("." + staged.target_.filename().string() + ".XXXXXX")).string();
  if (mkdtemp(folder.data()) == nullptr)
    return invalid_argument(path + ": cannot write beside it: " + std::generic_category().message(errno));
  staged.folder_ = folder;
  staged.path_ = (staged.folder_ / staged.target_.filename()).string();
  return staged;
}

StagedFile::~StagedFile() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

Status StagedFile::commit() {
  if (folder_.empty()) return {};
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
