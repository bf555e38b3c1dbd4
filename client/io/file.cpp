// SPDX-License-Identifier: Apache-2.0
// Files: see file.h.
#include "client/io/file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace warmfront::client {
namespace {

Error file_error(const std::string& path, const char* what, int code) {
  return invalid_argument(path + ": " + what + ": " + std::generic_category().message(code));
}

}  // namespace

Result<std::string> read_file(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return file_error(path, "cannot read", EISDIR);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) return file_error(path, "cannot open", errno);
  std::string bytes;
  // Read to the end instead of trusting a size: pipes have none.
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  for (;;) {
    const std::size_t have = bytes.size();
    bytes.resize(have + kBlock);
    const std::size_t got = std::fread(bytes.data() + have, 1, kBlock, file.get());
    bytes.resize(have + got);
    if (got < kBlock) break;
  }
  if (std::ferror(file.get())) return file_error(path, "cannot read", errno);
  return bytes;
}

Status make_folder(const std::string& path) {
  std::error_code code;
  std::filesystem::create_directories(path, code);
  if (code) return invalid_argument(path + ": cannot make the folder: " + code.message());
  return {};
}

Status check_writable(std::span<const std::string> paths) {
  for (const std::string& path : paths) {
    if (path.empty() || path == "-") continue;
    const bool exists = access(path.c_str(), F_OK) == 0;
    const std::string folder = std::filesystem::path(path).parent_path().string();
    const std::string& asked = exists ? path : folder.empty() ? std::string(".") : folder;
    struct stat status {};
    if (access(asked.c_str(), W_OK) != 0 || stat(asked.c_str(), &status) != 0)
      return file_error(path, "cannot write", errno);
    if (exists && S_ISDIR(status.st_mode)) return file_error(path, "cannot write", EISDIR);
    if (!exists && !S_ISDIR(status.st_mode)) return file_error(path, "cannot write", ENOTDIR);
  }
  return {};
}

Result<OutputFile> OutputFile::create(const std::string& path) {
  // Of stdout there is one buffer, so that who flushes it flushes all.
  if (path == "-") return OutputFile(path, stdout);
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) return file_error(path, "cannot write", errno);
  std::setvbuf(file, nullptr, _IOFBF, std::size_t{1} << 18);
  return OutputFile(path, file);
}

Result<OutputFile> OutputFile::create_whole(const std::string& path) {
  Result<StagedFile> staged = StagedFile::create(path);
  if (!staged) return staged.error();
  Result<OutputFile> file = create(staged.value().path());
  if (!file) return file;
  file.value().path_ = path;
  file.value().staged_ = std::make_unique<StagedFile>(std::move(staged).value());
  return file;
}

void OutputFile::write(std::string_view bytes) {
  if (error_ != 0 || !file_ || bytes.empty()) return;
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) error_ = errno ? errno : EIO;
}

Status OutputFile::flush() {
  errno = 0;
  if (file_ && std::fflush(file_.get()) != 0 && error_ == 0) error_ = errno ? errno : EIO;
  if (error_ != 0) return file_error(path_, "cannot write", error_);
  return {};
}

Status OutputFile::close() {
  if (file_) {
    (void)flush();  // its error is kept
    errno = 0;
    std::FILE* file = file_.release();
    if (file != stdout && std::fclose(file) != 0 && error_ == 0) error_ = errno ? errno : EIO;
  }
  if (error_ != 0) return file_error(path_, "cannot write", error_);
  const std::unique_ptr<StagedFile> staged = std::move(staged_);
  return staged ? staged->commit() : Status();
}

Status write_file(const std::string& path, std::string_view bytes) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  file.value().write(bytes);
  return file.value().close();
}

}  // namespace warmfront::client
