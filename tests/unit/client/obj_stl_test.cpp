// SPDX-License-Identifier: Apache-2.0
// OBJ and STL: accepted and refused files; OBJ against tinyobjloader, which reads the same topology.
#define TINYOBJLOADER_IMPLEMENTATION
#define TINYOBJLOADER_USE_DOUBLE
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <tiny_obj_loader.h>

#include <sstream>
#include <string>

#include "client/io/endian.h"
#include "client/io/obj.h"
#include "client/io/stl.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Face = std::array<std::int32_t, 3>;

template <class Parse>
std::string error_of(Parse parse, std::string_view bytes) {
  const Result<Mesh> mesh = parse(bytes, "m");
  return mesh ? "" : mesh.error().message;
}

constexpr std::string_view kObj =
    "# a comment\r\nmtllib a.mtl\no thing\nf 1/1/1 2//2 -1 4\nv 0 0 0\n"
    "v 1 0 0 0.5 0.5 0.5\nv 1 1\t0.1\nvt 0 0\nvn 0 0 1\nv 0 1 \\\n 0\ns off\nf -4 -3 -2 # the first three\nl "
    "1 2\n";

TEST(Obj, ReadsVerticesAndFacesOnly) {
  // -1 before any vertex counts back beyond the first.
  EXPECT_THAT(error_of(parse_obj, kObj), HasSubstr("line 4: vertex index -1 counts back"));
  std::string text(kObj);
  text.replace(text.find("-1"), 2, "3 ");
  const Result<Mesh> mesh = parse_obj(text, "m.obj");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_THAT(std::get<1>(mesh.value().positions), ElementsAre(0, 0, 0, 1, 0, 0, 1, 1, 0.1, 0, 1, 0));
  EXPECT_THAT(mesh.value().faces, ElementsAre(Face{0, 1, 2}, Face{0, 2, 3}, Face{0, 1, 2}));
}

TEST(Obj, RefusesWhatItCannotTrust) {
  EXPECT_THAT(error_of(parse_obj, "v 0 0\n"), HasSubstr("m: line 1: a vertex needs three"));
  EXPECT_THAT(error_of(parse_obj, "v 0 abc 0\n"), HasSubstr("'abc' is no number"));
  EXPECT_THAT(error_of(parse_obj, "v 0 0 0\n\nf 1 1 2\n"),
              HasSubstr("line 3: vertex index 2, but the file has 1"));
  EXPECT_THAT(error_of(parse_obj, "v 0 0 0\nf 0 1 1\n"), HasSubstr("start at 1"));
  EXPECT_THAT(error_of(parse_obj, "v 0 0 0\nf 1 1\n"), HasSubstr("needs three vertices"));
  EXPECT_THAT(error_of(parse_obj, "f 9223372036854775807 1 1\n"), HasSubstr("too large"));
  EXPECT_THAT(error_of(parse_obj, "f -9223372036854775808 1 1\n"), HasSubstr("counts back"));
}

TEST(Obj, AFaceMayRepeatAVertex) {
  const Result<Mesh> mesh = parse_obj("v 0 0 0\nv 1 0 0\nf 1 1 2\nf 2 2 2\n", "m.obj");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_THAT(mesh.value().faces, ElementsAre(Face{0, 0, 1}, Face{1, 1, 1}));
}

TEST(Obj, PolygonsAreListedWithTheirPlaceAndLinesAreEdges) {
  const Result<Mesh> mesh = parse_obj(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\n\nf 1 2 3 4\nl 1 2\nl 1 2 3 # two\nl -1 1/4\n", "m.obj");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  ASSERT_EQ(mesh.value().polygons.size(), 1U);
  const Polygon& polygon = mesh.value().polygons[0];
  EXPECT_EQ((std::array{polygon.first_face, polygon.corners, polygon.line, polygon.number}),
            (std::array<std::size_t, 4>{1, 4, 7, 1}));
  using Edge = std::array<std::int32_t, 2>;
  EXPECT_THAT(mesh.value().edges, ElementsAre(Edge{0, 1}, Edge{0, 1}, Edge{1, 2}, Edge{3, 0}));
}

TEST(Obj, EveryTruncationIsHandled) {
  for (std::size_t size = 0; size < kObj.size(); ++size) (void)parse_obj(kObj.substr(0, size), "m");
  EXPECT_TRUE(parse_obj("", "m").ok());
}

RC_GTEST_PROP(Obj, CoordinatesKeepTheirBitsAndFacesAreThoseOfTinyobjloader,
              (const std::vector<std::array<double, 3>>& points, const std::vector<std::uint32_t>& corners)) {
  RC_PRE(!points.empty());
  std::ostringstream out;
  out.precision(17);
  for (const auto& p : points) out << "v " << p[0] << " " << p[1] << " " << p[2] << "\n";
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
    out << "f " << 1 + corners[i] % points.size() << "/1 " << 1 + corners[i + 1] % points.size() << " -"
        << 1 + corners[i + 2] % points.size() << "//3\n";
  const Result<Mesh> mesh = parse_obj(out.str(), "m.obj");
  RC_ASSERT(mesh.ok());
  const auto& positions = std::get<1>(mesh.value().positions);
  for (std::size_t i = 0; i < positions.size(); ++i) RC_ASSERT(positions[i] == points[i / 3][i % 3]);

  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warning, error;
  std::istringstream in(out.str());
  RC_ASSERT(tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, &error, &in));
  std::vector<Face> faces;
  for (const tinyobj::shape_t& shape : shapes)
    for (std::size_t i = 0; i + 2 < shape.mesh.indices.size(); i += 3)
      faces.push_back({shape.mesh.indices[i].vertex_index, shape.mesh.indices[i + 1].vertex_index,
                       shape.mesh.indices[i + 2].vertex_index});
  RC_ASSERT(mesh.value().faces == faces);
}

constexpr std::string_view kStl =
    "solid a thing\r\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 1 1 0\n"
    "  endloop\n endfacet\n facet normal 0 0 1\n  outer loop\n   vertex 1 1 0\n   vertex 0 1 0\n   vertex 0 "
    "0 0\n"
    "  endloop\n endfacet\nendsolid a thing\n";

std::string binary_stl(std::string header, const std::vector<std::array<float, 9>>& facets) {
  header.resize(80);
  append_little(header, static_cast<std::uint32_t>(facets.size()));
  for (const auto& facet : facets) {
    for (int k = 0; k < 3; ++k) append_little(header, 0.0f);
    for (const float x : facet) append_little(header, x);
    append_little(header, std::uint16_t{0});
  }
  return header;
}

TEST(Stl, AsciiAndBinaryWeldInOrderOfAppearance) {
  const Result<Mesh> text = parse_stl(kStl, "m.stl");
  ASSERT_TRUE(text.ok()) << text.error().message;
  EXPECT_THAT(std::get<1>(text.value().positions), ElementsAre(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0));
  EXPECT_THAT(text.value().faces, ElementsAre(Face{0, 1, 2}, Face{2, 3, 0}));
  // A binary file may start with "solid" too.
  const std::string bytes =
      binary_stl("solid but binary", {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {1, 1, 0, 0, 1, 0, 0, 0, 0}});
  const Result<Mesh> binary = parse_stl(bytes, "m.stl");
  ASSERT_TRUE(binary.ok()) << binary.error().message;
  EXPECT_THAT(std::get<0>(binary.value().positions), ElementsAre(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0));
  EXPECT_EQ(binary.value().faces, text.value().faces);
}

TEST(Stl, OnlyEqualBitsAreWelded) {
  const Result<Mesh> mesh =
      parse_stl(binary_stl("", {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {-0.0f, 0, 0, 1, 1, 0, 0, 1, 0}}), "m.stl");
  ASSERT_TRUE(mesh.ok());
  EXPECT_THAT(mesh.value().faces, ElementsAre(Face{0, 1, 2}, Face{3, 2, 4}));
}

TEST(Stl, AFacetMayHaveTwoCornersInOnePlace) {
  const Result<Mesh> mesh = parse_stl(binary_stl("x", {{0, 0, 0, 0, 0, 0, 1, 1, 0}}), "m.stl");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_THAT(mesh.value().faces, ElementsAre(Face{0, 0, 1}));
}

TEST(Stl, EveryTruncationIsRefused) {
  for (std::size_t size = 0; size + 17 < kStl.size(); ++size)
    EXPECT_NE(error_of(parse_stl, kStl.substr(0, size)), "") << "cut at " << size;
  const std::string bytes = binary_stl("x", {{0, 0, 0, 1, 0, 0, 1, 1, 0}});
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_NE(error_of(parse_stl, std::string_view(bytes).substr(0, size)), "") << "cut at " << size;
}

TEST(Stl, RefusesWhatItCannotTrust) {
  std::string bytes = binary_stl("x", {{0, 0, 0, 1, 0, 0, 1, 1, 0}});
  for (int k = 80; k < 84; ++k) bytes[static_cast<std::size_t>(k)] = '\xff';
  EXPECT_THAT(error_of(parse_stl, bytes), HasSubstr("4294967295 facets"));
  std::string text(kStl);
  text.replace(text.find("1 1 0"), 5, "1 q 0");
  EXPECT_THAT(error_of(parse_stl, text), HasSubstr("m: line 6: coordinate 'q'"));
  EXPECT_THAT(error_of(parse_stl, "solid\nvertex 0 0 0\n"), HasSubstr("line 2: 'vertex' is out of place"));
}

TEST(Text, NumbersAreWholeWordsRoundedToNearest) {
  double x = 0;
  EXPECT_TRUE(parse_number("+0.1", x));
  EXPECT_EQ(x, 0.1);
  EXPECT_TRUE(parse_number("1e-400", x));
  EXPECT_EQ(x, 0.0);
  for (const char* bad : {"", "+", "+-1", "1.0x", "0x10", " 1", "1,5"})
    EXPECT_FALSE(parse_number(bad, x)) << bad;
  EXPECT_EQ(in_quotes("a\x1b[31m"), "'a?[31m'");
}

}  // namespace
}  // namespace warmfront::client
