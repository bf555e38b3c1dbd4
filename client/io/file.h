// SPDX-License-Identifier: Apache-2.0
// Reads whole files and writes streamed files, reporting every disk error. One thread at a time each.
#pragma once

#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "client/io/staged_file.h"
#include "engine/result.h"

namespace warmfront::client {

/// The bytes of a file. Fails with the path and the system's reason.
Result<std::string> read_file(const std::string& path);

/// A file being written. Errors are kept until close(), so that writers need not check every call.
class OutputFile {
 public:
  /// Creates or truncates `path`; "-" is stdout, which stays open.
  static Result<OutputFile> create(const std::string& path);
  /// The same, but `path` gets what is written when it is closed, without an error: until then what has that
  /// name stays as it is (StagedFile).
  static Result<OutputFile> create_whole(const std::string& path);

  void write(std::string_view bytes);

  /// Passes buffered data to the system; returns the first error since create().
  Status flush();

  /// Flushes and closes; the first error since create(), with the path and the system's reason.
  Status close();

 private:
  struct Closer {
    void operator()(std::FILE* file) const {
      if (file != stdout) std::fclose(file);
    }
  };
  OutputFile(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}

  std::string path_;                    // its own, where it is staged
  std::unique_ptr<StagedFile> staged_;  // null: it is written in its place
  std::unique_ptr<std::FILE, Closer> file_;
  int error_ = 0;
};

/// Creates the folder and missing parents.
Status make_folder(const std::string& path);

/// Fails for the first path whose folder does not exist or that this user may not write; creates nothing. ""
/// and "-" pass. For results that take long to compute.
Status check_writable(std::span<const std::string> paths);

/// Creates `path` with `bytes` in it.
Status write_file(const std::string& path, std::string_view bytes);

}  // namespace warmfront::client
