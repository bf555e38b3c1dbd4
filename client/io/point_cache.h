// SPDX-License-Identifier: Apache-2.0
// Positions of a mesh frame by frame, from a file of any of the formats that are read. One thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

class PointCache {
 public:
  virtual ~PointCache() = default;

  std::uint32_t point_count() const { return points_; }
  std::uint32_t frame_count() const { return frames_; }

  /// Reads frame `index` in [0, frame_count) into `positions`, (n, 3), in the file's precision and in any
  /// order.
  virtual Status read(std::uint32_t index, PositionBuffer& positions) = 0;

 protected:
  PointCache(std::uint32_t points, std::uint32_t frames) : points_(points), frames_(frames) {}

 private:
  std::uint32_t points_;
  std::uint32_t frames_;
};

/// Whether the name ends in .pc2, .mdd or .npy, in any case.
bool is_point_cache_name(std::string_view path);

/// Opens a cache by its name. Fails as Pc2Reader::open(), MddReader::open() and NpyArray::open() do, and for
/// an .npy file whose array is no (frames, n, 3) of float32 or float64.
Result<std::unique_ptr<PointCache>> open_point_cache(const std::string& path);

}  // namespace warmfront::client
