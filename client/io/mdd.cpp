// SPDX-License-Identifier: Apache-2.0
#include "client/io/mdd.h"

#include <algorithm>
#include <bit>
#include <filesystem>
#include <limits>

#include "client/io/endian.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

constexpr std::uint64_t kPointBytes = 3 * sizeof(float);

/// The frames begin behind the times.
std::uint64_t frames_at(const MddHeader& header) {
  return MddHeader::kBytes + std::uint64_t{header.frame_count} * sizeof(float);
}

template <class T>
void append_big(std::string& out, T value) {
  const std::size_t at = out.size();
  append_little(out, value);
  std::reverse(out.begin() + static_cast<std::ptrdiff_t>(at), out.end());
}

}  // namespace

Result<MddHeader> parse_mdd_header(std::string_view bytes, std::uint64_t size, std::string_view file) {
  if (bytes.size() < MddHeader::kBytes)
    return error_at_byte(file, bytes.size(), "the file ends within the MDD header");
  const auto frames = load_scalar<std::int32_t>(bytes.data(), std::endian::big);
  const auto points = load_scalar<std::int32_t>(bytes.data() + 4, std::endian::big);
  if (frames < 0) return error_at_byte(file, 0, std::to_string(frames) + " frames");
  if (points < 0) return error_at_byte(file, 4, std::to_string(points) + " points");
  const MddHeader header{static_cast<std::uint32_t>(frames), static_cast<std::uint32_t>(points)};
  // Both fit in 31 bits: their product times 12 may not fit in 64, so divide.
  const std::uint64_t frame = header.point_count * kPointBytes;
  const std::uint64_t begin = frames_at(header);
  const bool fits = size >= begin && (frame == 0 ? size == begin
                                                 : (size - begin) % frame == 0 &&
                                                       (size - begin) / frame == header.frame_count);
  if (!fits)
    return error_at_byte(file, size,
                         "the file ends here, which is no MDD of " + std::to_string(header.frame_count) +
                             " frames of " + std::to_string(header.point_count) + " points");
  return header;
}

Result<MddReader> MddReader::open(const std::string& path) {
  std::error_code code;
  const std::uint64_t size = std::filesystem::file_size(path, code);
  if (code) return invalid_argument(path + ": cannot open: " + code.message());
  std::ifstream file(path, std::ios::binary);
  if (!file) return invalid_argument(path + ": cannot open");
  std::string bytes(MddHeader::kBytes, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  const Result<MddHeader> header = parse_mdd_header(bytes, size, path);
  if (!header) return header.error();
  return MddReader(path, std::move(file), header.value());
}

Status MddReader::read(std::uint32_t index, std::vector<float>& positions) {
  if (index >= header_.frame_count)
    return invalid_argument(path_ + ": no frame " + std::to_string(index) + ", it has " +
                            std::to_string(header_.frame_count));
  const std::uint64_t frame = header_.point_count * kPointBytes;
  positions.resize(std::size_t{header_.point_count} * 3);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(frames_at(header_) + frame * index));
  file_.read(reinterpret_cast<char*>(positions.data()), static_cast<std::streamsize>(frame));
  if (static_cast<std::uint64_t>(file_.gcount()) != frame)
    return invalid_argument(path_ + ": cannot read frame " + std::to_string(index));
  if constexpr (std::endian::native != std::endian::big)
    for (float& x : positions) x = load_scalar<float>(reinterpret_cast<const char*>(&x), std::endian::big);
  return {};
}

Result<MddWriter> MddWriter::create(const std::string& path, const MddHeader& header, double seconds) {
  constexpr auto kMost = static_cast<std::uint32_t>(std::numeric_limits<std::int32_t>::max());
  if (header.point_count > kMost || header.frame_count > kMost)
    return invalid_argument(path + ": MDD holds no more than 2147483647 points and frames");
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  std::string bytes;
  append_big(bytes, header.frame_count);
  append_big(bytes, header.point_count);
  for (std::uint32_t frame = 0; frame < header.frame_count; ++frame)
    append_big(bytes, static_cast<float>(frame * seconds));
  file.value().write(bytes);
  return MddWriter(std::move(file).value(), header);
}

void MddWriter::append(std::span<const float> positions) {
  std::string bytes;
  bytes.reserve(positions.size_bytes());
  for (const float x : positions) append_big(bytes, x);
  file_.write(bytes);
  values_written_ += positions.size();
}

Status MddWriter::close() {
  if (Status status = file_.close(); !status) return status;
  if (values_written_ != std::uint64_t{header_.point_count} * 3 * header_.frame_count)
    return Error{ErrorCode::kInternal, "MDD: " + std::to_string(values_written_) +
                                           " values written, which is not what the header says"};
  return {};
}

}  // namespace warmfront::client
