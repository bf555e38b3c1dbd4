// SPDX-License-Identifier: Apache-2.0
// numpy's files: .npy, an array, and .npz, a ZIP archive of such. An array is read in parts; it is used by
// one thread at a time. Formats: numpy.lib.format, versions 1 to 3; PKWARE's APPNOTE, as numpy.savez writes
// it.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

struct NpyHeader {
  char kind = 'f';       ///< f: floats, i: integers, u: unsigned ones
  std::size_t size = 4;  ///< bytes of a number: 4 or 8 of f, 1, 2, 4 or 8 of the others
  std::endian order = std::endian::little;
  std::vector<std::uint64_t> shape;
  std::uint64_t data_at = 0;  ///< of the bytes where the numbers begin

  /// "(76, 5127, 3) of <f4".
  std::string text() const;
};

inline constexpr std::size_t kMostNpyHeader = std::size_t{1} << 16;

/// Reads the header at the start of `bytes`, which are the first kMostNpyHeader of the array, or all; `file`
/// names the source in errors. Fails for other types, and for arrays in Fortran's order.
Result<NpyHeader> parse_npy_header(std::string_view bytes, std::string_view file);

class NpyArray {
 public:
  /// Opens a .npy file, or the array at bytes [at, at + size) of another. Fails when it is not as long as its
  /// header says.
  static Result<NpyArray> open(const std::string& path);
  static Result<NpyArray> open(const std::string& path, const std::string& name, std::uint64_t at,
                               std::uint64_t size);

  const NpyHeader& header() const { return header_; }

  /// Of an array that check_frames() takes: frame `index` in [0, shape[0]), in its precision.
  Status read_frame(std::uint64_t index, PositionBuffer& positions);
  /// Of an array of integers, (m, columns): its rows. Fails when a number is not in [0, 2^31).
  Status read_rows(std::vector<std::array<std::int32_t, 3>>& rows);
  Status read_rows(std::vector<std::array<std::int32_t, 2>>& rows);

 private:
  NpyArray(std::string name, std::ifstream file, std::uint64_t at, NpyHeader header)
      : name_(std::move(name)), file_(std::move(file)), at_(at), header_(std::move(header)) {}
  template <std::size_t N>
  Status read_indices(std::vector<std::array<std::int32_t, N>>& rows);
  Status read_bytes(std::uint64_t first_number, std::uint64_t count, char* bytes);

  std::string name_;
  std::ifstream file_;
  std::uint64_t at_;
  NpyHeader header_;
};

/// Fails unless the array is (frames, n, 3) of float32 or float64, of fewer than 2^31 frames and vertices.
Status check_frames(const NpyHeader& header, const std::string& name);

/// An array in a .npz file.
struct NpzMember {
  std::string name;  ///< without .npy
  std::uint64_t at = 0;
  std::uint64_t size = 0;
};

/// The arrays of a .npz file, in its order. Fails for an archive that is cut short, or has compressed members
/// (numpy.savez_compressed), whose frames could not be read one by one.
Result<std::vector<NpzMember>> list_npz(const std::string& path);

}  // namespace warmfront::client
