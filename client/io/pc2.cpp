// SPDX-License-Identifier: Apache-2.0
// PC2: see pc2.h.
#include "client/io/pc2.h"

#include <bit>
#include <filesystem>
#include <limits>

#include "client/io/endian.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

constexpr std::string_view kMagic("POINTCACHE2\0", 12);

std::uint64_t bytes_per_sample(const Pc2Header& header) {
  return std::uint64_t{header.point_count} * 3 * sizeof(float);
}

}  // namespace

Result<Pc2Header> parse_pc2_header(std::string_view bytes, std::string_view file) {
  if (bytes.substr(0, kMagic.size()) != kMagic.substr(0, bytes.size()))
    return error_at_byte(file, 0, "not a PC2 file: it must start with 'POINTCACHE2'");
  if (bytes.size() < Pc2Header::kBytes)
    return error_at_byte(file, bytes.size(), "the file ends within the PC2 header");
  const auto integer = [&](std::size_t at) {
    return load_scalar<std::int32_t>(bytes.data() + at, std::endian::little);
  };
  if (integer(12) != 1) return error_at_byte(file, 12, "unknown PC2 version " + std::to_string(integer(12)));
  if (integer(16) < 0) return error_at_byte(file, 16, std::to_string(integer(16)) + " points");
  if (integer(28) < 0) return error_at_byte(file, 28, std::to_string(integer(28)) + " samples");
  Pc2Header header;
  header.point_count = static_cast<std::uint32_t>(integer(16));
  header.start_frame = load_scalar<float>(bytes.data() + 20, std::endian::little);
  header.sample_rate = load_scalar<float>(bytes.data() + 24, std::endian::little);
  header.sample_count = static_cast<std::uint32_t>(integer(28));
  return header;
}

Result<Pc2Reader> Pc2Reader::open(const std::string& path) {
  std::error_code code;
  const std::uint64_t size = std::filesystem::file_size(path, code);
  if (code) return invalid_argument(path + ": cannot open: " + code.message());
  std::ifstream file(path, std::ios::binary);
  if (!file) return invalid_argument(path + ": cannot open");
  std::string bytes(Pc2Header::kBytes, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  const Result<Pc2Header> header = parse_pc2_header(bytes, path);
  if (!header) return header.error();
  // Points and samples fit in 31 bits each: their product times 12 may not fit in 64, so divide.
  const std::uint64_t sample = bytes_per_sample(header.value());
  if (sample > 0 && (size - Pc2Header::kBytes) / sample < header.value().sample_count)
    return error_at_byte(path, size,
                         "the file ends here, but the header says " +
                             std::to_string(header.value().sample_count) + " samples of " +
                             std::to_string(sample) + " bytes");
  file.clear();
  return Pc2Reader(path, std::move(file), header.value());
}

Status Pc2Reader::read(std::uint32_t index, std::vector<float>& positions) {
  if (index >= header_.sample_count)
    return invalid_argument(path_ + ": no sample " + std::to_string(index) + ", it has " +
                            std::to_string(header_.sample_count));
  const std::uint64_t sample = bytes_per_sample(header_);
  positions.resize(std::size_t{header_.point_count} * 3);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(Pc2Header::kBytes + sample * index));
  file_.read(reinterpret_cast<char*>(positions.data()), static_cast<std::streamsize>(sample));
  if (static_cast<std::uint64_t>(file_.gcount()) != sample)
    return invalid_argument(path_ + ": cannot read sample " + std::to_string(index));
  if constexpr (std::endian::native != std::endian::little)
    for (float& x : positions) x = load_scalar<float>(reinterpret_cast<const char*>(&x), std::endian::little);
  return {};
}

Result<Pc2Writer> Pc2Writer::create(const std::string& path, const Pc2Header& header) {
  constexpr auto kMost = static_cast<std::uint32_t>(std::numeric_limits<std::int32_t>::max());
  if (header.point_count > kMost || header.sample_count > kMost)
    return invalid_argument(path + ": PC2 holds no more than 2147483647 points and samples");
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  std::string bytes(kMagic);
  append_little(bytes, std::int32_t{1});
  append_little(bytes, header.point_count);
  append_little(bytes, header.start_frame);
  append_little(bytes, header.sample_rate);
  append_little(bytes, header.sample_count);
  file.value().write(bytes);
  return Pc2Writer(std::move(file).value(), header);
}

void Pc2Writer::append(std::span<const float> positions) {
  if constexpr (std::endian::native == std::endian::little) {
    file_.write({reinterpret_cast<const char*>(positions.data()), positions.size_bytes()});
  } else {
    std::string bytes;
    for (const float x : positions) append_little(bytes, x);
    file_.write(bytes);
  }
  values_written_ += positions.size();
}

Status Pc2Writer::close() {
  if (Status status = file_.close(); !status) return status;
  if (values_written_ != std::uint64_t{header_.point_count} * 3 * header_.sample_count)
    return Error{ErrorCode::kInternal, "PC2: " + std::to_string(values_written_) +
                                           " values written, which is not what the header says"};
  return {};
}

}  // namespace warmfront::client
