// SPDX-License-Identifier: Apache-2.0
#include "client/cli/merge/contacts.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>
#include <vector>

#include "client/io/file.h"
#include "client/io/vtp.h"

namespace warmfront::client {
namespace {

namespace fs = std::filesystem;

/// The ending that says how the contacts of a file are written.
std::string format_of(const std::string& path) {
  return path == "-" ? ".csv" : fs::path(path).extension().string();
}

std::string file_of(const Part& part) {
  return (fs::path(part.path).parent_path() / part.range.contacts->file).lexically_normal().string();
}

std::string again(const Part& part) {
  return "; run 'warmfront detect --frames " + to_text(part.range.frames) + "' again";
}

Status check_files(std::span<const Part> parts, const std::string& path) {
  for (const Part& part : parts) {
    if (!part.range.contacts)
      return invalid_argument(part.path +
                              ": its run wrote no contacts to a file; run 'warmfront detect' again with "
                              "--contacts, or leave it out here");
    const std::string file = file_of(part);
    if (format_of(file) != format_of(path))
      return invalid_argument(file + ": contacts in " + format_of(file) + " are not joined to " +
                              format_of(path) + "; name a file that ends in " + format_of(file));
    if (path != "-" && fs::absolute(file).lexically_normal() == fs::absolute(path).lexically_normal())
      return invalid_argument("--contacts " + path + " is what " + part.path +
                              " has its contacts in; name another");
  }
  return {};
}

/// Copies the lines behind a header of so many lines, which is copied too if it is the first, and else must
/// be `header`; counts the others.
class LineCopy {
 public:
  LineCopy(OutputFile& to, bool with_header) : to_(to), with_header_(with_header) {}

  Status copy(const Part& part) {
    const std::string path = file_of(part);
    std::ifstream from(path, std::ios::binary);
    if (!from)
      return invalid_argument(path + ": cannot open the contacts of " + part.path + ": " +
                              std::strerror(errno) + again(part));
    if (with_header_) {
      std::string header;
      std::getline(from, header);
      if (!first_ && header != header_)
        return invalid_argument(path + ": its columns are '" + header + "', not '" + header_ + "'" +
                                again(part));
      if (first_) to_.write(header + "\n");
      header_ = std::move(header);
    }
    first_ = false;
    std::uint64_t rows = 0;
    char last = '\n';
    std::vector<char> block(std::size_t{1} << 18);
    for (;;) {
      from.read(block.data(), static_cast<std::streamsize>(block.size()));
      const std::string_view got(block.data(), static_cast<std::size_t>(from.gcount()));
      if (got.empty()) break;
      rows += static_cast<std::uint64_t>(std::ranges::count(got, '\n'));
      last = got.back();
      to_.write(got);
      if (Status status = to_.flush(); !status) return status;
    }
    if (rows != part.range.contacts->rows || last != '\n')
      return invalid_argument(path + ": " + std::to_string(rows) + " rows, but " + part.path + " says " +
                              std::to_string(part.range.contacts->rows) + ": it was changed or cut short" +
                              again(part));
    return {};
  }

 private:
  OutputFile& to_;
  const bool with_header_;
  bool first_ = true;
  std::string header_;
};

Status copy_lines(std::span<const Part> parts, const std::string& path) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  LineCopy lines(file.value(), format_of(path) == ".csv");
  for (const Part& part : parts)
    if (Status status = lines.copy(part); !status) return status;
  return file.value().close();
}

Status copy_series(std::span<const Part> parts, const std::string& path) {
  Result<VtpSeries> series = VtpSeries::create(path);
  if (!series) return series.error();
  for (const Part& part : parts) {
    const std::string stem = file_of(part);
    const auto [first, last] = part.range.frames;
    const std::uint64_t substeps = part.range.substeps;
    for (std::uint64_t number = first * substeps + 1; number <= last * substeps; ++number) {
      const Result<std::string> bytes = read_file(VtpSeries::file_of(stem, number));
      if (!bytes) return invalid_argument(bytes.error().message + again(part));
      if (Status status = series.value().add(number, bytes.value()); !status) return status;
    }
  }
  return series.value().close();
}

}  // namespace

Result<WrittenContacts> merge_contacts(std::span<const Part> parts, const std::string& path,
                                       const std::string& to) {
  if (Status status = check_files(parts, path); !status) return status.error();
  if (Status status = format_of(path) == ".vtp" ? copy_series(parts, to) : copy_lines(parts, to); !status)
    return status.error();
  WrittenContacts written;
  written.file = path;
  for (const Part& part : parts) written.rows += part.range.contacts->rows;
  return written;
}

}  // namespace warmfront::client
