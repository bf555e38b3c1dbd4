// SPDX-License-Identifier: Apache-2.0
// The directory of a .npz archive: see npy.h.
#include <algorithm>
#include <filesystem>

#include "client/io/endian.h"
#include "client/io/npy.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

constexpr std::uint64_t kEndBytes = 22;      // of the record that ends the archive, without its comment
constexpr std::uint64_t kLocatorBytes = 20;  // of ZIP64's record that says where its end record is
constexpr std::uint64_t kEntryBytes = 46;    // of a directory's entry, without its name
constexpr std::uint64_t kLocalBytes = 30;    // of what precedes a member, without its name
constexpr std::uint32_t kInZip64 = 0xffffffff;

/// Reads the archive, and remembers where it is not what it should be.
class Archive {
 public:
  Archive(const std::string& path, std::uint64_t size)
      : path_(path), size_(size), file_(path, std::ios::binary) {}

  bool open() const { return static_cast<bool>(file_); }
  std::uint64_t size() const { return size_; }

  /// Bytes [at, at + count), or nothing, which is an error at `at`.
  std::string bytes(std::uint64_t at, std::uint64_t count) {
    std::string read;
    if (at <= size_ && count <= size_ - at) {
      read.resize(count);
      file_.clear();
      file_.seekg(static_cast<std::streamoff>(at));
      file_.read(read.data(), static_cast<std::streamsize>(count));
      read.resize(static_cast<std::size_t>(file_.gcount()));
    }
    if (read.size() != count) read.clear();
    return read;
  }
  Error error(std::uint64_t at, const std::string& what) const { return error_at_byte(path_, at, what); }

 private:
  const std::string path_;
  const std::uint64_t size_;
  std::ifstream file_;
};

template <class T>
std::uint64_t field(std::string_view bytes, std::size_t at) {
  return load_scalar<T>(bytes.data() + at, std::endian::little);
}

struct Directory {
  std::uint64_t at = 0;
  std::uint64_t size = 0;
  std::uint64_t entries = 0;
};

/// The end record is the last that looks like one: behind it is a comment of at most 65,535 bytes.
Result<Directory> find_directory(Archive& archive) {
  const std::uint64_t tail_size = std::min<std::uint64_t>(archive.size(), kEndBytes + 0xffff);
  const std::uint64_t tail_at = archive.size() - tail_size;
  const std::string tail = archive.bytes(tail_at, tail_size);
  const std::size_t end =
      tail.size() < kEndBytes ? std::string::npos : tail.rfind("PK\5\6", tail.size() - kEndBytes);
  if (end == std::string::npos)
    return archive.error(archive.size(),
                         "no .npz: the end of a ZIP archive is expected here; is it cut short?");
  const std::string_view record = std::string_view(tail).substr(end);
  Directory directory{field<std::uint32_t>(record, 16), field<std::uint32_t>(record, 12),
                      field<std::uint16_t>(record, 10)};
  if (directory.at != kInZip64 && directory.size != kInZip64 && directory.entries != 0xffff) return directory;
  const std::uint64_t end_at = tail_at + end;
  if (end_at < kLocatorBytes) return archive.error(end_at, "no place for ZIP64's records");
  const std::string locator = archive.bytes(end_at - kLocatorBytes, kLocatorBytes);
  if (!locator.starts_with("PK\6\7")) return archive.error(end_at - kLocatorBytes, "no locator of ZIP64");
  const std::uint64_t at = field<std::uint64_t>(locator, 8);
  const std::string wide = archive.bytes(at, 56);
  if (!wide.starts_with("PK\6\6")) return archive.error(at, "no end record of ZIP64");
  return Directory{field<std::uint64_t>(wide, 48), field<std::uint64_t>(wide, 40),
                   field<std::uint64_t>(wide, 32)};
}

/// What an entry leaves to its field of ZIP64: those of size, compressed size and place that are full, in
/// this order.
bool take_wide(std::string_view extra, NpzMember& member, std::uint64_t& compressed) {
  while (extra.size() >= 4) {
    const std::uint64_t size = field<std::uint16_t>(extra, 2);
    if (size > extra.size() - 4) return false;
    if (field<std::uint16_t>(extra, 0) == 1) {
      std::string_view numbers = extra.substr(4, size);
      for (std::uint64_t* value : {&member.size, &compressed, &member.at}) {
        if (*value != kInZip64) continue;
        if (numbers.size() < 8) return false;
        *value = field<std::uint64_t>(numbers, 0);
        numbers.remove_prefix(8);
      }
      return true;
    }
    extra.remove_prefix(4 + size);
  }
  return member.size != kInZip64 && compressed != kInZip64 && member.at != kInZip64;
}

/// From where the entry says that the member's own header is to where its bytes begin.
Status find_bytes(Archive& archive, NpzMember& member) {
  const std::string local = archive.bytes(member.at, kLocalBytes);
  if (!local.starts_with("PK\3\4")) return archive.error(member.at, "no member of the archive");
  const std::uint64_t before =
      kLocalBytes + field<std::uint16_t>(local, 26) + field<std::uint16_t>(local, 28);
  if (before > archive.size() - member.at || member.size > archive.size() - member.at - before)
    return archive.error(archive.size(), "the file ends within '" + member.name + "'");
  member.at += before;
  return {};
}

}  // namespace

Result<std::vector<NpzMember>> list_npz(const std::string& path) {
  std::error_code code;
  const std::uint64_t size = std::filesystem::file_size(path, code);
  if (code) return invalid_argument(path + ": cannot open: " + code.message());
  Archive archive(path, size);
  if (!archive.open()) return invalid_argument(path + ": cannot open");
  const Result<Directory> found = find_directory(archive);
  if (!found) return found.error();
  const Directory& directory = found.value();
  const std::string entries = archive.bytes(directory.at, directory.size);
  if (entries.size() != directory.size || directory.entries > directory.size / kEntryBytes)
    return archive.error(directory.at, "no directory of " + std::to_string(directory.entries) + " members");
  std::vector<NpzMember> members;
  std::string_view rest = entries;
  for (std::uint64_t i = 0; i < directory.entries; ++i) {
    const std::uint64_t at = directory.at + (entries.size() - rest.size());
    if (rest.size() < kEntryBytes || !rest.starts_with("PK\1\2"))
      return archive.error(at, "no entry of the directory");
    const std::uint64_t name = field<std::uint16_t>(rest, 28), extra = field<std::uint16_t>(rest, 30);
    const std::uint64_t whole = kEntryBytes + name + extra + field<std::uint16_t>(rest, 32);
    if (whole > rest.size()) return archive.error(at, "an entry that is longer than the directory");
    NpzMember member{std::string(rest.substr(kEntryBytes, name)), field<std::uint32_t>(rest, 42),
                     field<std::uint32_t>(rest, 24)};
    std::uint64_t compressed = field<std::uint32_t>(rest, 20);
    const std::string said = in_quotes(member.name);
    if (!take_wide(rest.substr(kEntryBytes + name, extra), member, compressed))
      return archive.error(at, "no sizes of " + said);
    if (field<std::uint16_t>(rest, 10) != 0)
      return archive.error(at, said +
                                   " is compressed, so that frames cannot be read one by one; write it with "
                                   "numpy.savez");
    if (compressed != member.size) return archive.error(at, "two sizes of " + said);
    if (Status status = find_bytes(archive, member); !status) return status.error();
    if (member.name.ends_with(".npy")) {
      member.name.resize(member.name.size() - 4);
      members.push_back(std::move(member));
    }
    rest.remove_prefix(whole);
  }
  return members;
}

}  // namespace warmfront::client
