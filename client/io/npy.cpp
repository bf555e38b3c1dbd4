// SPDX-License-Identifier: Apache-2.0
#include "client/io/npy.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <type_traits>

#include "client/io/endian.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

constexpr std::string_view kNpyMagic("\x93NUMPY", 6);
constexpr std::uint64_t kMostCount = std::numeric_limits<std::int32_t>::max();

/// What follows `'key':` in the header's dictionary, without blanks; empty if it is not there.
std::string_view after_key(std::string_view dictionary, std::string_view key) {
  for (const char quote : {'\'', '"'}) {
    const std::string quoted = quote + std::string(key) + quote;
    std::size_t at = dictionary.find(quoted);
    if (at == std::string_view::npos) continue;
    at = dictionary.find_first_not_of(" :", at + quoted.size());
    return at == std::string_view::npos ? std::string_view() : dictionary.substr(at);
  }
  return {};
}

bool take_type(std::string_view text, NpyHeader& header) {
  if (text.size() < 5 || (text[0] != '\'' && text[0] != '"') || text[4] != text[0]) return false;
  if (text[1] != '<' && text[1] != '>' && text[1] != '|') return false;
  header.order = text[1] == '>' ? std::endian::big : std::endian::little;
  header.kind = text[2];
  header.size = static_cast<std::size_t>(text[3] - '0');
  const bool whole = header.kind == 'i' || header.kind == 'u';
  return (header.kind == 'f' && (header.size == 4 || header.size == 8)) ||
         (whole && (header.size == 1 || header.size == 2 || header.size == 4 || header.size == 8));
}

bool take_shape(std::string_view text, NpyHeader& header) {
  if (text.empty() || text[0] != '(') return false;
  const char* at = text.data() + 1;
  const char* const end = text.data() + text.size();
  const auto skip = [&](std::string_view any) {
    while (at != end && any.find(*at) != std::string_view::npos) ++at;
  };
  for (skip(" "); at != end && *at != ')'; skip(" ,L")) {
    std::uint64_t number = 0;
    const auto [next, code] = std::from_chars(at, end, number);
    if (code != std::errc()) return false;
    header.shape.push_back(number);
    at = next;
  }
  return at != end;
}

/// Bytes of all numbers; nothing if they do not fit in 63 bits.
std::optional<std::uint64_t> bytes_of(const NpyHeader& header) {
  std::uint64_t bytes = header.size;
  for (const std::uint64_t length : header.shape) {
    if (length != 0 && bytes > (std::uint64_t{1} << 63) / length) return std::nullopt;
    bytes *= length;
  }
  return bytes;
}

template <class T>
std::int64_t integer_at(const char* bytes, std::endian order) {
  const T value = load_scalar<T>(bytes, order);
  // What does not fit is refused like what is too large.
  return std::in_range<std::int64_t>(value) ? static_cast<std::int64_t>(value) : -1;
}

std::int64_t integer_of(const NpyHeader& header, const char* bytes) {
  const bool is_signed = header.kind == 'i';
  switch (header.size) {
    case 1:
      return is_signed ? integer_at<std::int8_t>(bytes, header.order)
                       : integer_at<std::uint8_t>(bytes, header.order);
    case 2:
      return is_signed ? integer_at<std::int16_t>(bytes, header.order)
                       : integer_at<std::uint16_t>(bytes, header.order);
    case 4:
      return is_signed ? integer_at<std::int32_t>(bytes, header.order)
                       : integer_at<std::uint32_t>(bytes, header.order);
    default:
      return is_signed ? integer_at<std::int64_t>(bytes, header.order)
                       : integer_at<std::uint64_t>(bytes, header.order);
  }
}

}  // namespace

std::string NpyHeader::text() const {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")") + " of " + (order == std::endian::big ? '>' : '<') + kind +
         std::to_string(size);
}

Result<NpyHeader> parse_npy_header(std::string_view bytes, std::string_view file) {
  if (bytes.substr(0, kNpyMagic.size()) != kNpyMagic.substr(0, bytes.size()))
    return error_at_byte(file, 0, "not an array of numpy: it must start with '\\x93NUMPY'");
  if (bytes.size() < 12) return error_at_byte(file, bytes.size(), "the file ends within the header");
  const int version = bytes[6];
  if (version < 1 || version > 3) return error_at_byte(file, 6, "unknown version " + std::to_string(version));
  const std::uint64_t begin = version == 1 ? 10 : 12;
  const std::uint64_t length = version == 1
                                   ? load_scalar<std::uint16_t>(bytes.data() + 8, std::endian::little)
                                   : load_scalar<std::uint32_t>(bytes.data() + 8, std::endian::little);
  if (length > kMostNpyHeader - begin)
    return error_at_byte(file, 8, "a header of " + std::to_string(length) + " bytes");
  if (bytes.size() < begin + length)
    return error_at_byte(file, bytes.size(), "the file ends within the header");
  const std::string_view dictionary = bytes.substr(begin, length);
  NpyHeader header;
  header.data_at = begin + length;
  const std::string_view type = after_key(dictionary, "descr");
  if (!take_type(type, header))
    return error_at_byte(file, begin,
                         "numbers of the type " + in_quotes(type.substr(0, type.find(','))) +
                             "; float32, float64 and integers are read");
  const std::string_view order = after_key(dictionary, "fortran_order");
  if (!order.starts_with("False"))
    return error_at_byte(file, begin, "an array in Fortran's order; save numpy.ascontiguousarray(array)");
  if (!take_shape(after_key(dictionary, "shape"), header)) return error_at_byte(file, begin, "no shape");
  return header;
}

Result<NpyArray> NpyArray::open(const std::string& path) {
  std::error_code code;
  const std::uint64_t size = std::filesystem::file_size(path, code);
  if (code) return invalid_argument(path + ": cannot open: " + code.message());
  return open(path, path, 0, size);
}

Result<NpyArray> NpyArray::open(const std::string& path, const std::string& name, std::uint64_t at,
                                std::uint64_t size) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return invalid_argument(path + ": cannot open");
  std::string bytes(std::min<std::uint64_t>(size, kMostNpyHeader), '\0');
  file.seekg(static_cast<std::streamoff>(at));
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  Result<NpyHeader> header = parse_npy_header(bytes, name);
  if (!header) return header.error();
  const std::optional<std::uint64_t> data = bytes_of(header.value());
  if (!data || size - header.value().data_at < *data)
    return error_at_byte(name, size, "the array ends here, but its header says " + header.value().text());
  file.clear();
  return NpyArray(name, std::move(file), at + header.value().data_at, std::move(header).value());
}

Status NpyArray::read_bytes(std::uint64_t first_number, std::uint64_t count, char* bytes) {
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(at_ + first_number * header_.size));
  file_.read(bytes, static_cast<std::streamsize>(count * header_.size));
  if (static_cast<std::uint64_t>(file_.gcount()) != count * header_.size)
    return invalid_argument(name_ + ": cannot read " + std::to_string(count) + " numbers from number " +
                            std::to_string(first_number) + " on");
  return {};
}

Status NpyArray::read_frame(std::uint64_t index, PositionBuffer& positions) {
  if (index >= header_.shape[0])
    return invalid_argument(name_ + ": no frame " + std::to_string(index) + ", it has " +
                            std::to_string(header_.shape[0]));
  if (header_.size == sizeof(float) && positions.index() != 0) positions.emplace<0>();
  if (header_.size == sizeof(double) && positions.index() != 1) positions.emplace<1>();
  const std::uint64_t count = 3 * header_.shape[1];
  return std::visit(
      [&](auto& values) -> Status {
        using Real = typename std::decay_t<decltype(values)>::value_type;
        values.resize(count);
        if (Status status = read_bytes(index * count, count, reinterpret_cast<char*>(values.data())); !status)
          return status;
        if (header_.order != std::endian::native)
          for (Real& x : values) x = load_scalar<Real>(reinterpret_cast<const char*>(&x), header_.order);
        return {};
      },
      positions);
}

template <std::size_t N>
Status NpyArray::read_indices(std::vector<std::array<std::int32_t, N>>& rows) {
  if (header_.kind == 'f' || header_.shape.size() != 2 || header_.shape[1] != N)
    return invalid_argument(name_ + ": " + header_.text() + "; integers of the shape (any, " +
                            std::to_string(N) + ") are expected");
  std::string bytes(header_.shape[0] * N * header_.size, '\0');
  if (Status status = read_bytes(0, header_.shape[0] * N, bytes.data()); !status) return status;
  rows.resize(header_.shape[0]);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (std::size_t k = 0; k < N; ++k) {
      const std::int64_t value = integer_of(header_, bytes.data() + (row * N + k) * header_.size);
      if (value < 0 || value > static_cast<std::int64_t>(kMostCount))
        return invalid_argument(name_ + "[" + std::to_string(row) + ", " + std::to_string(k) +
                                "] is no vertex's number");
      rows[row][k] = static_cast<std::int32_t>(value);
    }
  }
  return {};
}

Status NpyArray::read_rows(std::vector<std::array<std::int32_t, 3>>& rows) {
  return read_indices(rows);
}
Status NpyArray::read_rows(std::vector<std::array<std::int32_t, 2>>& rows) {
  return read_indices(rows);
}

Status check_frames(const NpyHeader& header, const std::string& name) {
  if (header.kind != 'f' || header.shape.size() != 3 || header.shape[2] != 3 ||
      header.shape[0] > kMostCount || header.shape[1] > kMostCount)
    return invalid_argument(name + ": " + header.text() +
                            "; positions are expected: (frames, vertices, 3) of float32 or float64");
  return {};
}

}  // namespace warmfront::client
