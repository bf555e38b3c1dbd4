// SPDX-License-Identifier: Apache-2.0
// Outputs that appear whole or not at all. One thread at a time each, but for remove_all().
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "engine/result.h"

namespace warmfront::client {

/// A file, or a series of files, that is written in a hidden folder beside its place and gets its name when
/// all of it is there. Until commit() what has that name stays as it is; without it nothing else stays. What
/// has the name and is no regular file (a pipe, /dev/null), and "-", are written as they are.
class StagedFile {
 public:
  /// For a file at `path`; a link is followed. Fails when its folder, or the file that is there, cannot be
  /// written to.
  static Result<StagedFile> create(const std::string& path);

  StagedFile(StagedFile&& other) noexcept
      : path_(std::move(other.path_)),
        target_(std::move(other.target_)),
        folder_(std::exchange(other.folder_, {})),
        lock_(std::exchange(other.lock_, -1)) {}
  StagedFile(const StagedFile&) = delete;
  StagedFile& operator=(const StagedFile&) = delete;
  StagedFile& operator=(StagedFile&&) = delete;
  ~StagedFile();

  /// Removes what is staged, of all there are, and says which files that would have been; none is staged,
  /// moved or removed from then on. For who ends the process at once. Any thread; returns when those that are
  /// being moved are in their place.
  static std::vector<std::string> remove_all();

  /// Where to write.
  const std::string& path() const { return path_; }

  /// Moves what was written, and closed, to its place: each file by renaming, with the permissions of the one
  /// that it replaces. Of a series the list (.pvd) comes last.
  Status commit();

 private:
  StagedFile() = default;

  std::string path_;
  std::filesystem::path target_;
  std::filesystem::path folder_;  ///< empty: nothing is staged
  int lock_ = -1;                 ///< of the folder, as long as this process lives
};

}  // namespace warmfront::client
