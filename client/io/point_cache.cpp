// SPDX-License-Identifier: Apache-2.0
#include "client/io/point_cache.h"

#include <utility>

#include "client/io/mdd.h"
#include "client/io/npy.h"
#include "client/io/pc2.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

/// PC2 and MDD, which are read alike.
template <class Reader>
class FloatCache final : public PointCache {
 public:
  FloatCache(Reader reader, std::uint32_t points, std::uint32_t frames)
      : PointCache(points, frames), reader_(std::move(reader)) {}

  Status read(std::uint32_t index, PositionBuffer& positions) override {
    if (positions.index() != 0) positions.emplace<0>();
    return reader_.read(index, std::get<0>(positions));
  }

 private:
  Reader reader_;
};

class NpyCache final : public PointCache {
 public:
  explicit NpyCache(NpyArray array)
      : PointCache(static_cast<std::uint32_t>(array.header().shape[1]),
                   static_cast<std::uint32_t>(array.header().shape[0])),
        array_(std::move(array)) {}

  Status read(std::uint32_t index, PositionBuffer& positions) override {
    return array_.read_frame(index, positions);
  }

 private:
  NpyArray array_;
};

}  // namespace

bool is_point_cache_name(std::string_view path) {
  return has_ending(path, ".pc2") || has_ending(path, ".mdd") || has_ending(path, ".npy");
}

Result<std::unique_ptr<PointCache>> open_point_cache(const std::string& path) {
  std::unique_ptr<PointCache> cache;
  if (has_ending(path, ".pc2")) {
    Result<Pc2Reader> reader = Pc2Reader::open(path);
    if (!reader) return reader.error();
    const Pc2Header header = reader.value().header();
    cache = std::make_unique<FloatCache<Pc2Reader>>(std::move(reader).value(), header.point_count,
                                                    header.sample_count);
  } else if (has_ending(path, ".mdd")) {
    Result<MddReader> reader = MddReader::open(path);
    if (!reader) return reader.error();
    const MddHeader header = reader.value().header();
    cache = std::make_unique<FloatCache<MddReader>>(std::move(reader).value(), header.point_count,
                                                    header.frame_count);
  } else if (has_ending(path, ".npy")) {
    Result<NpyArray> array = NpyArray::open(path);
    if (!array) return array.error();
    if (Status status = check_frames(array.value().header(), path); !status) return status.error();
    cache = std::make_unique<NpyCache>(std::move(array).value());
  } else {
    return invalid_argument(path + ": no cache by its name: .pc2, .mdd and .npy are read");
  }
  return cache;
}

}  // namespace warmfront::client
