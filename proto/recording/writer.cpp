// SPDX-License-Identifier: Apache-2.0
// Appending records. Thread safety as stated in the header.
#include "proto/recording/writer.h"

#include <fcntl.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <unistd.h>

#include <cerrno>
#include <new>
#include <system_error>
#include <utility>

#include "proto/recording/format.h"

namespace warmfront::recording {
namespace {

std::string framed(const v1::RecordedMessage& message) {
  const std::size_t size = message.ByteSizeLong();
  std::string bytes;
  bytes.reserve(size + kMostLengthBytes);
  {
    google::protobuf::io::StringOutputStream out(&bytes);
    google::protobuf::io::CodedOutputStream coded(&out);
    coded.WriteVarint64(size);
    message.SerializeWithCachedSizes(&coded);
  }
  return bytes;
}

std::string reason_of(int code) {
  return std::generic_category().message(code);
}

}  // namespace

Result<std::string> record_of(const v1::RecordedMessage& message) {
  const std::size_t bytes = message.ByteSizeLong();
  if (bytes > kMostRecordBytes)
    return Error{ErrorCode::kResourceExhausted,
                 "a record of " + std::to_string(bytes) + " bytes is too large"};
  return framed(message);
}

Result<std::unique_ptr<Writer>> Writer::create(const std::string& path, const std::string& program,
                                               WriterOptions options) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file < 0) return invalid_argument(path + ": cannot create: " + reason_of(errno));
  const auto began = options.began.value_or(std::chrono::system_clock::now());
  std::unique_ptr<Writer> writer(new Writer(file, path, std::move(options)));
  v1::RecordedMessage message;
  v1::RecordingHeader& header = *message.mutable_header();
  header.set_version(kVersion);
  header.set_writer(program);
  header.set_started_unix_ms(
      std::chrono::duration_cast<std::chrono::milliseconds>(began.time_since_epoch()).count());
  if (!writer->put(std::string(kMagic))) {
    const int code = errno;
    writer->stopped_ = "nothing is written";
    unlink(path.c_str());
    return invalid_argument(path + ": cannot write: " + reason_of(code));
  }
  writer->append(framed(message));
  return writer;
}

Writer::Writer(int file, std::string path, WriterOptions options)
    : file_(file), path_(std::move(path)), options_(std::move(options)) {}

Writer::~Writer() {
  try {
    if (stopped_.empty()) put_end(true, "");
  } catch (const std::bad_alloc&) {
    // Readers treat it as truncated.
  }
  close(file_);
}

bool Writer::put(const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const char* const from = bytes.data() + at;
    const std::size_t count = bytes.size() - at;
    const ssize_t done = options_.put ? options_.put(file_, from, count) : ::write(file_, from, count);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      if (done == 0) errno = ENOSPC;
      return false;
    }
    at += static_cast<std::size_t>(done);
  }
  written_ += bytes.size();
  return true;
}

void Writer::write(v1::RecordedMessage message) {
  if (!stopped_.empty()) return;
  message.set_at_us(static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start_)
          .count()));
  try {
    const Result<std::string> record = record_of(message);
    if (!record) return stop(record.error().message);
    append(record.value());
  } catch (const std::bad_alloc&) {
    stop("out of memory");
  }
}

void Writer::append(const std::string& record) {
  if (!stopped_.empty()) return;
  if (options_.admit && !options_.admit(record.size()))
    return stop("the bound on recordings is met: --record-max-bytes");
  admitted_ += record.size();
  if (!put(record)) stop(reason_of(errno));
}

void Writer::stop(const std::string& reason) {
  if (!stopped_.empty()) return;
  stopped_ = reason;
  put_end(false, reason);
  if (options_.stopped) options_.stopped(reason);
}

void Writer::put_end(bool complete, const std::string& reason) {
  // If a record was written only partly, the marker replaces it.
  if (ftruncate(file_, static_cast<off_t>(written_)) != 0 ||
      lseek(file_, static_cast<off_t>(written_), SEEK_SET) < 0)
    return;
  v1::RecordedMessage message;
  message.mutable_end()->set_complete(complete);
  message.mutable_end()->set_reason(reason);
  static_cast<void>(put(framed(message)));
}

void Writer::discard() {
  if (stopped_.empty()) stopped_ = "discarded";
  unlink(path_.c_str());
  if (options_.give_back) options_.give_back(std::exchange(admitted_, 0));
}

}  // namespace warmfront::recording
