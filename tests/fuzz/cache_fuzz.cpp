// SPDX-License-Identifier: Apache-2.0
// Any bytes as a PC2 cache and as info.json: refused with a place, or read within the file; what info.json
// says survives being written and read again. One thread.
#include "client/io/info_json.h"
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
  check_info(bytes);
  return 0;
}
