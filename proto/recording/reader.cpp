// SPDX-License-Identifier: Apache-2.0
// Parses records. Thread safety as stated in the header.
#include "proto/recording/reader.h"

#include <google/protobuf/stubs/logging.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

#include "proto/recording/format.h"

namespace warmfront::recording {

Error Reader::error(std::uint64_t byte, const std::string& what) const {
  return invalid_argument(path_ + ": byte " + std::to_string(byte) + ": " + what);
}

Result<Reader> Reader::open(const std::string& path) {
  const auto system = [&path](int code) {
    return invalid_argument(path + ": cannot read: " + std::generic_category().message(code));
  };
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return system(errno);
  Reader reader(path, file, 0);
  struct stat status {};
  if (fstat(fileno(file), &status) != 0) return system(errno);
  if (!S_ISREG(status.st_mode)) return invalid_argument(path + ": not a file; a recording is read from one");
  reader.size_ = static_cast<std::uint64_t>(status.st_size);

  std::array<char, kMagic.size()> magic{};
  if (std::fread(magic.data(), 1, magic.size(), file) != magic.size() ||
      std::string_view(magic.data(), magic.size()) != kMagic)
    return reader.error(0, "not a recording: it does not begin with WFREC, CR, LF, 0x1a");
  reader.at_ = magic.size();
  auto first = reader.next();
  if (!first) return first.error();
  if (!first.value() || !first.value()->has_header())
    return reader.error(magic.size(), "a recording begins with its header");
  reader.header_ = std::move(*first.value()->mutable_header());
  if (reader.header_.version() != kVersion)
    return reader.error(magic.size(), "version " + std::to_string(reader.header_.version()) +
                                          " of the format; this program reads version " +
                                          std::to_string(kVersion));
  return reader;
}

Result<std::optional<v1::RecordedMessage>> Reader::torn(std::uint64_t from) {
  torn_bytes_ = size_ - from;
  at_ = size_;
  return std::optional<v1::RecordedMessage>();
}

Result<std::optional<v1::RecordedMessage>> Reader::next() {
  const std::uint64_t begin = at_;
  if (begin >= size_) return std::optional<v1::RecordedMessage>();
  if (ended_) return error(begin, "the recording goes on behind its end");
  std::uint64_t length = 0;
  for (std::size_t i = 0;; ++i) {
    if (i == kMostLengthBytes) return error(begin, "no record's length");
    const int byte = std::fgetc(file_.get());
    if (byte == EOF) return torn(begin);
    ++at_;
    length |= static_cast<std::uint64_t>(byte & 0x7f) << (7 * i);
    if ((byte & 0x80) == 0) break;
  }
  if (length > kMostRecordBytes)
    return error(begin, "a record of " + std::to_string(length) + " bytes; " +
                            std::to_string(kMostRecordBytes) + " are the most");
  if (length > size_ - std::min(at_, size_)) return torn(begin);
  std::string bytes(length, '\0');
  if (std::fread(bytes.data(), 1, length, file_.get()) != length) return torn(begin);
  at_ += length;
  v1::RecordedMessage message;
  // Errors are returned; suppress Protocol Buffers' own messages on stderr.
  const google::protobuf::LogSilencer quiet;
  if (!message.ParseFromString(bytes)) return error(begin, "a record that is no RecordedMessage");
  if (message.what_case() == v1::RecordedMessage::WHAT_NOT_SET)
    return error(begin, "a record of a kind that is not known");
  if (message.has_header() && begin != kMagic.size()) return error(begin, "a second header");
  ended_ = message.has_end();
  return std::optional(std::move(message));
}

}  // namespace warmfront::recording
