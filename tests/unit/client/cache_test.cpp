// SPDX-License-Identifier: Apache-2.0
// PC2 and info.json: round trips, truncation, hostile headers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "client/io/endian.h"
#include "client/io/info_json.h"
#include "client/io/pc2.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;

std::string header_bytes(std::int32_t version, std::int32_t points, std::int32_t samples) {
  std::string bytes("POINTCACHE2\0", 12);
  append_little(bytes, version);
  append_little(bytes, points);
  append_little(bytes, 0.0f);
  append_little(bytes, 1.0f);
  append_little(bytes, samples);
  return bytes;
}

std::string open_error(const TemporaryFolder& folder, std::string_view bytes) {
  const Result<Pc2Reader> reader = Pc2Reader::open(folder.write("c.pc2", bytes));
  return reader ? "" : reader.error().message;
}

TEST(Pc2, FramesComeBackInAnyOrder) {
  const TemporaryFolder folder;
  const std::vector<std::vector<float>> frames{
      {0, 1, 2, 3, 4, 5}, {6, 7, 8, 9, 10, 11}, {-1, -2, -3, -4, -5, -6}};
  Result<Pc2Writer> writer = Pc2Writer::create(folder.file("c.pc2"), {2, 7, 0.5f, 3});
  ASSERT_TRUE(writer.ok());
  for (const auto& frame : frames) writer.value().append(frame);
  ASSERT_TRUE(writer.value().close().ok());
  EXPECT_EQ(folder.read("c.pc2").size(), 32U + 3 * 2 * 12);

  Result<Pc2Reader> reader = Pc2Reader::open(folder.file("c.pc2"));
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader.value().header().start_frame, 7);
  EXPECT_EQ(reader.value().header().sample_rate, 0.5f);
  std::vector<float> positions;
  for (const std::uint32_t i : {2U, 0U, 1U, 1U}) {
    ASSERT_TRUE(reader.value().read(i, positions).ok());
    EXPECT_EQ(positions, frames[i]);
  }
  EXPECT_FALSE(reader.value().read(3, positions).ok());
}

TEST(Pc2, TheWriterHoldsTheHeaderToItsWord) {
  const TemporaryFolder folder;
  Result<Pc2Writer> writer = Pc2Writer::create(folder.file("c.pc2"), {1, 0, 1, 2});
  ASSERT_TRUE(writer.ok());
  writer.value().append(std::vector<float>{1, 2, 3});
  EXPECT_FALSE(writer.value().close().ok());
}

TEST(Pc2, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  const std::string whole = header_bytes(1, 2, 2) + std::string(48, 'x');
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_NE(open_error(folder, std::string_view(whole).substr(0, size)), "") << "cut at " << size;
  EXPECT_EQ(open_error(folder, whole), "");
}

TEST(Pc2, HostileHeadersAreRefused) {
  const TemporaryFolder folder;
  EXPECT_THAT(open_error(folder, header_bytes(1, 2147483647, 2147483647)), HasSubstr("byte 32"));
  EXPECT_THAT(open_error(folder, header_bytes(1, -1, 1)), HasSubstr("byte 16"));
  EXPECT_THAT(open_error(folder, header_bytes(1, 1, -5)), HasSubstr("byte 28"));
  EXPECT_THAT(open_error(folder, header_bytes(2, 1, 0)), HasSubstr("version 2"));
  EXPECT_THAT(open_error(folder, "POINTCACHE3" + std::string(40, '\0')), HasSubstr("not a PC2 file"));
}

constexpr std::string_view kInfo =
    R"({"name": "n", "triangles": 2, "vertices": 7, "frames": 3, "fps": 24, "generator": "g", "other": [1],
    "bodies": [{"name": "a", "first_vertex": 0, "vertex_count": 4, "kind": "rigid", "thickness": 0.25},
               {"name": "b", "first_vertex": 4, "vertex_count": 3, "kind": "static", "group": 6, "mask": 5,
                "self_collision": false},
               {"name": "c", "first_vertex": 7, "vertex_count": 0, "kind": "static",
                "half_space": {"point": [0, 0.1, -2], "normal": [0, 0, 3]}}],
    "excluded_pairs": [[1, 0]],
    "filters": {"within_edges": 2, "near_at_rest": 0.5, "excluded_vertex_pairs": [[6, 0], [1, 2]],
                "patches": [1, 1, 1, 0, 2, 2, 2]},
    "vertex_thickness": [0, 0.5, 0, 0, 0, 1, 0]})";

TEST(InfoJson, RoundTrips) {
  const Result<SceneInfo> info = parse_info_json(kInfo, "info.json");
  ASSERT_TRUE(info.ok()) << info.error().message;
  const Result<SceneInfo> back = parse_info_json(format_info_json(info.value()), "info.json");
  ASSERT_TRUE(back.ok()) << back.error().message;
  for (const SceneInfo& i : {info.value(), back.value()}) {
    EXPECT_EQ(i.name, "n");
    EXPECT_EQ(i.vertices, 7U);
    EXPECT_EQ(i.frames, 3U);
    EXPECT_EQ(i.fps, 24);
    EXPECT_EQ(i.generator, "g");
    ASSERT_EQ(i.bodies.size(), 3U);
    EXPECT_EQ(i.bodies[2].half_space, (HalfSpace{{0, 0.1, -2}, {0, 0, 3}}));
    EXPECT_FALSE(i.bodies[1].half_space);
    EXPECT_EQ(i.bodies[1].name, "b");
    EXPECT_EQ(i.bodies[1].first_vertex, 4U);
    EXPECT_EQ(i.bodies[1].kind, BodyKind::kStatic);
    EXPECT_EQ(i.bodies[1].group, 6U);
    EXPECT_EQ(i.bodies[1].mask, 5U);
    EXPECT_FALSE(i.bodies[1].self_collision);
    EXPECT_EQ(i.bodies[0].thickness, 0.25);
    EXPECT_EQ(i.bodies[1].thickness, 0);
    EXPECT_EQ(i.thickness, (std::vector<double>{0, 0.5, 0, 0, 0, 1, 0}));
    EXPECT_TRUE(i.bodies[0].self_collision);
    EXPECT_EQ(i.excluded_pairs, (std::vector<std::array<std::uint32_t, 2>>{{1, 0}}));
    EXPECT_EQ(i.filters, (PairFilters{.within_edges = 2,
                                      .near_at_rest = 0.5,
                                      .excluded_vertex_pairs = {{6, 0}, {1, 2}},
                                      .patches = {1, 1, 1, 0, 2, 2, 2}}));
  }
}

TEST(InfoJson, EveryTruncationIsRefused) {
  for (std::size_t size = 0; size < kInfo.size(); ++size)
    EXPECT_FALSE(parse_info_json(kInfo.substr(0, size), "info.json").ok()) << "cut at " << size;
}

TEST(InfoJson, ErrorsNameTheField) {
  const auto error = [](std::string text) { return parse_info_json(text, "i").error().message; };
  EXPECT_THAT(error("[]"), HasSubstr("i: must be an object"));
  EXPECT_THAT(error(R"({"frames": -1})"), HasSubstr("'frames' must be a whole number"));
  EXPECT_THAT(error(R"({"bodies": {}})"), HasSubstr("'bodies' must be a list"));
  EXPECT_THAT(error(R"({"excluded_pairs": [[0]]})"), HasSubstr("'excluded_pairs' must hold pairs"));
  EXPECT_THAT(error(R"({"filters": 1})"), HasSubstr("'filters' must be an object"));
  EXPECT_THAT(error(R"({"filters": {"within_edges": 4}})"),
              HasSubstr("filters: 'within_edges' must be a whole number in [0, 3]"));
  EXPECT_THAT(error(R"({"filters": {"near_at_rest": -1}})"), HasSubstr("filters: 'near_at_rest' must be"));
  EXPECT_THAT(error(R"({"filters": {"excluded_vertex_pairs": [[1]]}})"),
              HasSubstr("filters: 'excluded_vertex_pairs' must hold pairs"));
  EXPECT_THAT(error(R"({"filters": {"patches": [0, -1]}})"), HasSubstr("filters: 'patches' must hold"));
  EXPECT_THAT(error(R"({"vertex_thickness": [0, "thin"]})"),
              HasSubstr("'vertex_thickness' must hold a length"));
  EXPECT_THAT(error(R"({"bodies": [{"first_vertex": 0}]})"), HasSubstr("body 0: 'vertex_count' is missing"));
  EXPECT_THAT(error(R"({"bodies": [{"first_vertex": 0, "vertex_count": 4294967296}]})"),
              HasSubstr("'vertex_count'"));
  EXPECT_THAT(error(R"({"bodies": [{"first_vertex": 0, "vertex_count": 1, "kind": "soft"}]})"),
              HasSubstr("'soft'"));
  const auto of_half_space = [&](const std::string& said) {
    return error(R"({"bodies": [{"first_vertex": 0, "vertex_count": 0, "half_space": )" + said + "}]}");
  };
  EXPECT_THAT(of_half_space("1"), HasSubstr("body 0: 'half_space' must be an object"));
  EXPECT_THAT(of_half_space(R"({"normal": [0, 0, 1]})"),
              HasSubstr("half_space: 'point' must hold 3 numbers"));
  EXPECT_THAT(of_half_space(R"({"point": [0, 0, 0], "normal": [0, "z", 1]})"),
              HasSubstr("'normal' must hold 3 numbers"));
  EXPECT_THAT(of_half_space(R"({"point": [0, 0, 0], "normal": [0, 0, 1], "radius": 1})"),
              HasSubstr("half_space: unknown key 'radius'"));
  EXPECT_THAT(error(std::string(100'000, '[')), HasSubstr("too deeply"));
}

// A misspelt key would otherwise be ignored without a warning.
TEST(InfoJson, UnknownKeysOfTheModelAreRefused) {
  const auto error = [](const std::string& text) {
    const Result<SceneInfo> info = parse_info_json(text, "i");
    return info ? "" : info.error().message;
  };
  EXPECT_EQ(error(R"({"bodies": [{"first_vertex": 0, "vertex_count": 1, "thicknes": 1}]})"),
            "i: body 0: unknown key 'thicknes'; the known ones are vertex_count, name, first_vertex, kind, "
            "self_collision, group, mask, thickness, screw, world, half_space");
  EXPECT_EQ(error(R"({"filters": {"within_edge": 1}})"),
            "i: filters: unknown key 'within_edge'; the known ones are within_edges, near_at_rest, "
            "excluded_vertex_pairs, patches");
  EXPECT_EQ(error(R"({"fitlers": {}})"), "i: unknown key 'fitlers'; is 'filters' meant?");
  for (const char* key : {"Bodies", "bodys", "excluded_pair", "excludedPairs", "filter", "vertexthickness"})
    EXPECT_THAT(error(std::string("{\"") + key + "\": []}"), HasSubstr("unknown key")) << key;
  for (const char* key : {"", "nam", "notes", "files", "by", "excluded", "source_filters", "vertex_colours"})
    EXPECT_EQ(error(std::string("{\"") + key + "\": []}"), "") << key;
}

}  // namespace
}  // namespace warmfront::client
