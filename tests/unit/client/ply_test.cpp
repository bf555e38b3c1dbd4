// SPDX-License-Identifier: Apache-2.0
// PLY: all three encodings, skipped parts, refused files, and round trips.
#include "client/io/ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Face = std::array<std::int32_t, 3>;

std::string error_of(std::string_view bytes) {
  const Result<Mesh> mesh = parse_ply(bytes, "m.ply");
  return mesh ? "" : mesh.error().message;
}

template <class T>
void put(std::string& out, T value, std::endian order) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
  out.append(raw.data(), raw.size());
}

constexpr std::string_view kAsciiBody =
    "comment made by hand\nobj_info nothing\n"
    "element vertex 4\nproperty float x\nproperty uchar red\nproperty float y\nproperty list uchar int tags\n"
    "property float z\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n"
    "element face 2\nproperty uchar flag\nproperty list uchar int vertex_indices\nend_header\n"
    "0 255 0 0 0\n1 255 0 2 7 8 0\n\n1 255 1 1 9 0.1\n0 255 +1 0 -2.5e-3\n"
    "0 1\n"
    "5 4 0 1 2 3\n6 3 3 2 1\n";

std::string ascii() {
  return "ply\nformat ascii 1.0\n" + std::string(kAsciiBody);
}

std::string with_crlf(std::string text) {
  for (std::size_t i = text.find('\n'); i != std::string::npos; i = text.find('\n', i + 2))
    text.insert(i, "\r");
  return text;
}

/// The same mesh as ascii(), in binary, with float64 x, int16 y and float32 z, uint32 list lengths and int8
/// indices.
std::string binary(std::endian order) {
  std::string out = "ply\nformat ";
  out += order == std::endian::big ? "binary_big_endian" : "binary_little_endian";
  out +=
      " 1.0\nelement extra 2\nproperty list uint16 double junk\nelement face 2\nproperty list uint32 int8 "
      "vertex_index\n"
      "property float quality\nelement vertex 4\nproperty double x\nproperty short y\nproperty float "
      "z\nend_header\n";
  put<std::uint16_t>(out, 2, order);
  put<double>(out, 1, order);
  put<double>(out, 2, order);
  put<std::uint16_t>(out, 0, order);
  for (const std::initializer_list<std::int8_t> polygon :
       {std::initializer_list<std::int8_t>{0, 1, 2, 3}, std::initializer_list<std::int8_t>{3, 2, 1}}) {
    put<std::uint32_t>(out, static_cast<std::uint32_t>(polygon.size()), order);
    for (const std::int8_t v : polygon) put(out, v, order);
    put<float>(out, 1, order);
  }
  const double x[] = {0, 1, 1, 0};
  const std::int16_t y[] = {0, 0, 1, -300};
  for (int v = 0; v < 4; ++v) {
    put(out, x[v], order);
    put(out, y[v], order);
    put(out, 0.1f * static_cast<float>(v), order);
  }
  return out;
}

TEST(Ply, ReadsAsciiInFloatAndSkipsTheRest) {
  const Result<Mesh> mesh = parse_ply(ascii(), "m.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  ASSERT_EQ(mesh.value().positions.index(), 0U);
  EXPECT_THAT(std::get<0>(mesh.value().positions), ElementsAre(0, 0, 0, 1, 0, 0, 1, 1, 0.1f, 0, 1, -2.5e-3f));
  EXPECT_THAT(mesh.value().faces, ElementsAre(Face{0, 1, 2}, Face{0, 2, 3}, Face{3, 2, 1}));
}

TEST(Ply, CarriageReturnsChangeNothing) {
  const Result<Mesh> unix = parse_ply(ascii(), "m.ply");
  const Result<Mesh> dos = parse_ply(with_crlf(ascii()), "m.ply");
  ASSERT_TRUE(dos.ok()) << dos.error().message;
  EXPECT_EQ(dos.value().positions, unix.value().positions);
  EXPECT_EQ(dos.value().faces, unix.value().faces);
}

TEST(Ply, ReadsBothByteOrdersAndAnyScalarType) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    const Result<Mesh> mesh = parse_ply(binary(order), "m.ply");
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    ASSERT_EQ(mesh.value().positions.index(), 1U) << "a double coordinate makes a double mesh";
    EXPECT_THAT(std::get<1>(mesh.value().positions),
                ElementsAre(0, 0, 0, 1, 0, double{0.1f}, 1, 1, double{0.1f * 2}, 0, -300, double{0.1f * 3}));
    EXPECT_THAT(mesh.value().faces, ElementsAre(Face{0, 1, 2}, Face{0, 2, 3}, Face{3, 2, 1}));
  }
}

TEST(Ply, EveryTruncatedBinaryIsRefused) {
  const std::string whole = binary(std::endian::big);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_NE(error_of(std::string_view(whole).substr(0, size)), "") << "cut at " << size;
}

TEST(Ply, EveryTruncatedAsciiIsHandled) {
  const std::string whole = ascii();
  // All but the last digit and line end are needed.
  for (std::size_t size = 0; size + 2 < whole.size(); ++size)
    EXPECT_NE(error_of(std::string_view(whole).substr(0, size)), "") << "cut at " << size;
}

TEST(Ply, HostileCountsAreRefusedBeforeAllocating) {
  for (const char* count : {"18446744073709551615", "4294967296", "2147483648", "2000000000"}) {
    const std::string head = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::string(count) +
                             "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    EXPECT_NE(error_of(head + "0123456789ab"), "") << count;
  }
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\nelement vertex 99999999\nproperty float x\nproperty float y\n"
                       "property float z\nend_header\n0 0 0\n"),
              HasSubstr("99999999"));
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n"), HasSubstr("line 3"));
  std::string list =
      "ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n";
  put<std::uint32_t>(list, 0xffffffffU, std::endian::little);
  EXPECT_NE(error_of(list), "");
}

TEST(Ply, ErrorsSayWhereAndWhat) {
  std::string text = ascii();
  text.replace(text.find("6 3 3 2 1"), 9, "6 3 3 2 4");
  EXPECT_THAT(error_of(text),
              HasSubstr("m.ply: line 25: face 1: vertex index 4 is not a whole number in [0, 4)"));
  text = ascii();
  text.replace(text.find("6 3 3 2 1"), 9, "6 2 3 2");
  EXPECT_THAT(error_of(text), HasSubstr("needs three"));
  text = ascii();
  text.replace(text.find("-2.5e-3"), 7, "-2.5x");
  EXPECT_THAT(error_of(text), HasSubstr("line 22: vertex 3: '-2.5x' is no number"));
  text = ascii();
  text.replace(text.find("-2.5e-3"), 7, "1 2");
  EXPECT_THAT(error_of(text), HasSubstr("more values"));
  EXPECT_THAT(error_of("plx\n"), HasSubstr("not a PLY file"));
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\nelement face 0\nend_header\n"),
              HasSubstr("no element 'vertex'"));
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"),
              HasSubstr("'y'"));
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n0\n"),
              HasSubstr("line 4: unknown property type 'half'"));
}

TEST(Ply, NanAndInfinityPassToTheEngine) {
  const Result<Mesh> mesh = parse_ply(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double "
      "z\nend_header\n"
      "nan -inf 1e999\n",
      "m.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  const auto& p = std::get<1>(mesh.value().positions);
  EXPECT_TRUE(std::isnan(p[0]));
  EXPECT_EQ(p[1], -std::numeric_limits<double>::infinity());
  EXPECT_EQ(p[2], std::numeric_limits<double>::infinity());
}

template <class T>
void round_trips(const std::vector<std::array<T, 3>>& points, const std::vector<std::uint32_t>& indices) {
  Mesh mesh;
  std::vector<T> positions;
  for (const auto& p : points) positions.insert(positions.end(), p.begin(), p.end());
  mesh.positions = positions;
  if (!points.empty()) {
    const auto n = static_cast<std::uint32_t>(points.size());
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
      mesh.faces.push_back({static_cast<std::int32_t>(indices[i] % n),
                            static_cast<std::int32_t>(indices[i + 1] % n),
                            static_cast<std::int32_t>(indices[i + 2] % n)});
  }
  const Result<Mesh> back = parse_ply(format_ply(mesh, "a comment"), "m.ply");
  RC_ASSERT(back.ok());
  RC_ASSERT(back.value().positions == mesh.positions);
  RC_ASSERT(back.value().faces == mesh.faces);
}

RC_GTEST_PROP(Ply, FloatMeshesRoundTrip,
              (const std::vector<std::array<float, 3>>& p, const std::vector<std::uint32_t>& i)) {
  round_trips(p, i);
}
RC_GTEST_PROP(Ply, DoubleMeshesRoundTrip,
              (const std::vector<std::array<double, 3>>& p, const std::vector<std::uint32_t>& i)) {
  round_trips(p, i);
}

RC_GTEST_PROP(Ply, FlippedBytesNeverCrash, (std::uint16_t at, std::uint8_t value, bool text)) {
  std::string bytes = text ? ascii() : binary(std::endian::little);
  bytes[at % bytes.size()] = static_cast<char>(value);
  const Result<Mesh> mesh = parse_ply(bytes, "m.ply");
  if (mesh.ok()) RC_ASSERT(vertex_count(mesh.value().positions) <= bytes.size());
}

}  // namespace
}  // namespace warmfront::client
