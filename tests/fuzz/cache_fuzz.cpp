// SPDX-License-Identifier: Apache-2.0
// Any bytes as a PC2, MDD or numpy file, and as info.json: refused with a place, or read within the file; what info.json
// says survives being written and read again. One thread.
#include "client/io/info_json.h"
#include "client/io/mdd.h"
#include "client/io/npy.h"
#include "client/io/pc2.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace warmfront;
using namespace warmfront::client;
using fuzz::expect;

void check_cache(std::string_view bytes) {
  const fuzz::MemoryFile file(bytes);
  Result<Pc2Reader> reader = Pc2Reader::open(file.path());
  if (!reader) return expect(!reader.error().message.empty(), "a refused cache has a reason");
  const Pc2Header& header = reader.value().header();
  expect(std::uint64_t{header.point_count} * header.sample_count * 12 + Pc2Header::kBytes <= bytes.size() ||
             header.point_count == 0,
         "an accepted cache is as long as it says");
  std::vector<float> positions;
  expect(!reader.value().read(header.sample_count, positions).ok(), "there is no sample after the last");
  for (std::uint32_t i = 0; i < std::min(header.sample_count, 3U); ++i) {
    expect(reader.value().read(i, positions).ok(), "every sample can be read");
    expect(positions.size() == std::size_t{3} * header.point_count, "a sample has all its points");
  }
}

void check_mdd(std::string_view bytes) {
  const fuzz::MemoryFile file(bytes);
  Result<MddReader> reader = MddReader::open(file.path());
  if (!reader) return expect(!reader.error().message.empty(), "a refused cache has a reason");
  const MddHeader& header = reader.value().header();
  expect(std::uint64_t{header.point_count} * header.frame_count * 12 + std::uint64_t{header.frame_count} * 4 +
                 MddHeader::kBytes ==
             bytes.size(),
         "an accepted cache is as long as it says");
  std::vector<float> positions;
  expect(!reader.value().read(header.frame_count, positions).ok(), "there is no frame after the last");
  for (std::uint32_t i = 0; i < std::min(header.frame_count, 3U); ++i)
    expect(reader.value().read(i, positions).ok() && positions.size() == std::size_t{3} * header.point_count,
           "every frame can be read, whole");
}

void check_array(Result<NpyArray> array) {
  if (!array) return expect(!array.error().message.empty(), "a refused array has a reason");
  std::vector<std::array<std::int32_t, 3>> rows;
  if (array.value().read_rows(rows))
    for (const auto& row : rows)
      for (const std::int32_t v : row) expect(v >= 0, "an index is not negative");
  if (!check_frames(array.value().header(), "fuzz")) return;
  const auto& shape = array.value().header().shape;
  PositionBuffer positions;
  expect(!array.value().read_frame(shape[0], positions).ok(), "there is no frame after the last");
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(shape[0], 3); ++i)
    expect(array.value().read_frame(i, positions).ok() && vertex_count(positions) == shape[1],
           "every frame can be read, whole");
}

void check_numpy(std::string_view bytes) {
  const fuzz::MemoryFile file(bytes);
  check_array(NpyArray::open(file.path()));
  const Result<std::vector<NpzMember>> members = list_npz(file.path());
  if (!members) return expect(!members.error().message.empty(), "a refused archive has a reason");
  for (const NpzMember& member : members.value()) {
    expect(member.at <= bytes.size() && member.size <= bytes.size() - member.at, "members lie in the archive");
    check_array(NpyArray::open(file.path(), member.name, member.at, member.size));
  }
}

void check_info(std::string_view bytes) {
  const Result<SceneInfo> info = parse_info_json(bytes, "fuzz");
  if (!info) return expect(info.error().message.starts_with("fuzz"), "an error names the file");
  const std::string text = format_info_json(info.value());
  const Result<SceneInfo> again = parse_info_json(text, "fuzz");
  expect(again.ok(), "what is written can be read");
  expect(format_info_json(again.value()) == text, "and says the same");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  check_cache(bytes);
  check_mdd(bytes);
  check_numpy(bytes);
  check_info(bytes);
  return 0;
}
