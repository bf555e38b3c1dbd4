// SPDX-License-Identifier: Apache-2.0
// Inputs: valid arguments, and the result of each kind.
#include "client/io/input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "client/io/file.h"
#include "client/io/obj.h"
#include "client/io/pc2.h"
#include "client/io/ply.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using Arguments = std::vector<std::string>;

std::string usage_error_of(const Arguments& arguments) {
  const Status status = check_input_arguments(arguments);
  return status ? "" : status.error().message;
}

std::string open_error(const Arguments& arguments) {
  const Result<std::unique_ptr<Input>> input = open_input(arguments);
  return input ? "" : input.error().message;
}

std::string triangle(float z) {
  return format_ply({std::vector<float>{0, 0, z, 1, 0, z, 0, 1, z}, {{0, 1, 2}}}, "");
}

/// A folder with a triangle that moves up, three frames.
void write_cache(const TemporaryFolder& folder) {
  folder.write("mesh.ply", triangle(0));
  Result<Pc2Writer> cache = Pc2Writer::create(folder.file("frames.pc2"), {3, 0, 1, 3});
  ASSERT_TRUE(cache.ok());
  for (const float z : {0.f, 1.f, 2.f}) cache.value().append(std::vector<float>{0, 0, z, 1, 0, z, 0, 1, z});
  ASSERT_TRUE(cache.value().close().ok());
}

TEST(Input, ArgumentsAreCheckedByTheirForm) {
  EXPECT_EQ(usage_error_of({"folder"}), "");
  EXPECT_EQ(usage_error_of({"a.ply", "b.OBJ", "c.stl"}), "");
  EXPECT_EQ(usage_error_of({"builtin:bart?frames=3"}), "");
  EXPECT_EQ(usage_error_of({"a.obj", "b.PC2"}), "");
  EXPECT_EQ(usage_error_of({"a.ply", "b.mdd"}), "");
  EXPECT_EQ(usage_error_of({"a.npz"}), "");
  EXPECT_THAT(usage_error_of({"b.pc2"}), HasSubstr("give the mesh file before it"));
  EXPECT_THAT(usage_error_of({"b.pc2", "a.obj"}), HasSubstr("b.pc2: a cache comes after one mesh file"));
  EXPECT_THAT(usage_error_of({"a.obj", "b.obj", "c.mdd"}),
              HasSubstr("c.mdd: a cache comes after one mesh file"));
  EXPECT_THAT(usage_error_of({"folder", "c.npy"}), HasSubstr("c.npy: a cache comes after one mesh file"));
  EXPECT_NE(usage_error_of({}), "");
  EXPECT_THAT(usage_error_of({"a.ply"}), HasSubstr("two or more"));
  EXPECT_THAT(usage_error_of({"a.ply", "folder"}), HasSubstr("folder"));
  EXPECT_THAT(usage_error_of({"a.ply", "builtin:bart"}), HasSubstr("stands alone"));
  EXPECT_THAT(
      usage_error_of({"builtin:barth"}),
      HasSubstr("cloth-ball, flamenco, n-body, princess, bart, hair, particles, ground, torn, cut, turning"));
}

TEST(Input, ACacheAfterAMeshGivesItsFrames) {
  const TemporaryFolder folder;
  write_cache(folder);
  const auto input = open_input(Arguments{folder.file("mesh.ply"), folder.file("frames.pc2")});
  ASSERT_TRUE(input.ok()) << input.error().message;
  EXPECT_EQ(input.value()->frame_count(), 3U);
  EXPECT_EQ(input.value()->name(), folder.file("frames.pc2"));
  PositionBuffer positions;
  ASSERT_TRUE(input.value()->read_frame(2, positions).ok());
  EXPECT_EQ(coordinate(view(positions), 2), 2);
  const std::string other =
      folder.write("other.ply", format_ply({std::vector<float>{0, 0, 0, 1, 0, 0}, {{0, 1, 1}}}, ""));
  EXPECT_THAT(open_error({other, folder.file("frames.pc2")}), HasSubstr("3 points, but"));
  EXPECT_THAT(open_error({folder.file("mesh.ply"), folder.file("none.mdd")}),
              HasSubstr("none.mdd: cannot open"));
  folder.write("frames.mdd", "");
  EXPECT_THAT(open_error({folder.path()}), HasSubstr("holds both frames.pc2 and frames.mdd"));
}

TEST(Input, ACacheFolderGivesFramesAndBodies) {
  const TemporaryFolder folder;
  write_cache(folder);
  folder.write("info.json", R"({"bodies":[{"name":"t","first_vertex":0,"vertex_count":3,"kind":"rigid"}]})");
  const Arguments arguments{folder.path()};
  Result<std::unique_ptr<Input>> input = open_input(arguments);
  ASSERT_TRUE(input.ok()) << input.error().message;
  EXPECT_EQ(input.value()->frame_count(), 3U);
  EXPECT_EQ(input.value()->scene().vertex_count, 3U);
  EXPECT_EQ(input.value()->scene().faces.size(), 1U);
  ASSERT_EQ(input.value()->scene().bodies.size(), 1U);
  EXPECT_EQ(input.value()->scene().bodies[0].kind, BodyKind::kRigid);
  PositionBuffer positions = std::vector<double>{};
  ASSERT_TRUE(input.value()->read_frame(2, positions).ok());
  EXPECT_THAT(std::get<0>(positions), ElementsAre(0, 0, 2, 1, 0, 2, 0, 1, 2));
  EXPECT_FALSE(input.value()->read_frame(3, positions).ok());
}

TEST(Input, AFolderMustHoldWhatItNeeds) {
  const TemporaryFolder folder;
  EXPECT_THAT(open_error({folder.file("missing")}), HasSubstr("no such file or folder"));
  EXPECT_THAT(open_error({folder.path()}), HasSubstr("holds neither"));
  folder.write("t00000.ply", triangle(0));
  EXPECT_THAT(open_error({folder.path()}),
              HasSubstr("in their order, as by $(ls -v " + folder.file("*.ply") + ")"));
  folder.write("mesh.ply", triangle(0));
  EXPECT_THAT(open_error({folder.path()}), HasSubstr("frames.pc2"));
  write_cache(folder);
  EXPECT_EQ(open_error({folder.path()}), "");
  folder.write("mesh.ply", format_ply({std::vector<float>(12, 0.f), {{0, 1, 2}}}, ""));
  EXPECT_THAT(open_error({folder.path()}), HasSubstr("3 points, but"));
  write_cache(folder);
  folder.write("info.json", "{");
  EXPECT_THAT(open_error({folder.path()}), HasSubstr("info.json"));
}

TEST(Input, AFolderOfNumberedMeshesIsASequence) {
  const TemporaryFolder folder;
  folder.write("t0.ply", triangle(0));
  folder.write("t1.ply", triangle(5));
  const Arguments arguments{folder.path()};
  Result<std::unique_ptr<Input>> input = open_input(arguments);
  ASSERT_TRUE(input.ok()) << input.error().message;
  EXPECT_EQ(input.value()->frame_count(), 2U);
  PositionBuffer positions;
  ASSERT_TRUE(input.value()->read_frame(1, positions).ok());
  EXPECT_EQ(std::get<0>(positions)[2], 5);
  ASSERT_TRUE(input.value()->read_frame(0, positions).ok());
  EXPECT_EQ(std::get<0>(positions)[2], 0);
}

TEST(Input, AFolderOfNumberedMeshesHasItsInfo) {
  const TemporaryFolder folder;
  folder.write("t0.ply", triangle(1));
  folder.write("t1.ply", triangle(5));
  folder.write("info.json", R"({
    "bodies": [{"name": "t", "first_vertex": 0, "vertex_count": 3, "kind": "static", "thickness": 0.5}],
    "filters": {"within_edges": 1, "near_at_rest": 0.25}, "vertex_thickness": [0, 0, 0.125]})");
  const Arguments arguments{folder.path()};
  Result<std::unique_ptr<Input>> input = open_input(arguments);
  ASSERT_TRUE(input.ok()) << input.error().message;
  const SceneDescription& scene = input.value()->scene();
  ASSERT_EQ(scene.bodies.size(), 1U);
  EXPECT_EQ(scene.bodies[0].kind, BodyKind::kStatic);
  EXPECT_EQ(scene.bodies[0].thickness, 0.5);
  EXPECT_EQ(scene.filters.within_edges, 1U);
  EXPECT_THAT(scene.filters.rest_positions, ElementsAre(0, 0, 1, 1, 0, 1, 0, 1, 1)) << "the first frame";
  EXPECT_THAT(scene.thickness, ElementsAre(0, 0, 0.125));

  // It belongs to the folder: files that are named one by one have none.
  const Arguments files{folder.file("t0.ply"), folder.file("t1.ply")};
  input = open_input(files);
  ASSERT_TRUE(input.ok()) << input.error().message;
  EXPECT_TRUE(input.value()->scene().bodies.empty());
  folder.write("info.json", "{");
  EXPECT_THAT(open_error(arguments), HasSubstr("info.json"));
  EXPECT_EQ(open_error(files), "");
}

// How a polygon is cut is decided by the first frame: in a later one it may lie otherwise, or even cross
// itself.
TEST(Input, PolygonsAreCutOnceForAllFrames) {
  const TemporaryFolder folder;
  const auto frame = [&](const char* name, const char* last, const char* face = "1 2 3 4") {
    return folder.write(name, std::string("v 1 -1 0\nv 1 1 0\nv -1 1 0\nv ") + last + " 0\nf " + face + "\n");
  };
  const std::string concave = frame("t0.obj", "0.25 0.25");
  const std::string convex = frame("t1.obj", "-1 -1");
  const std::string crossed = frame("t2.obj", "2 0.5");
  const std::string other = frame("t3.obj", "0.25 0.25", "4 1 2 3");
  Arguments arguments{concave, convex, crossed, concave, other};
  Result<std::unique_ptr<Input>> input = open_input(arguments);
  ASSERT_TRUE(input.ok()) << input.error().message;
  ASSERT_EQ(input.value()->scene().faces.size(), 2U);
  for (const auto& face : input.value()->scene().faces)
    EXPECT_NE(face, (std::array<std::int32_t, 3>{0, 1, 2})) << "it covers the notch";
  PositionBuffer positions;
  for (const std::uint32_t k : {1U, 2U, 3U}) {
    const Status read = input.value()->read_frame(k, positions);
    EXPECT_TRUE(read.ok()) << k << ": " << read.error().message;
  }
  EXPECT_THAT(input.value()->read_frame(4, positions).error().message, HasSubstr("another topology"));
  EXPECT_THAT(open_error({crossed, concave}),
              HasSubstr("t2.obj: line 5: a polygon of 4 corners crosses itself"));
  // Another program may have saved the same triangles.
  std::string same = "v 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0.25 0.25 0\n";
  for (const auto& f : input.value()->scene().faces)
    same += "f " + std::to_string(f[0] + 1) + " " + std::to_string(f[1] + 1) + " " +
            std::to_string(f[2] + 1) + "\n";
  arguments = {concave, folder.write("same.obj", same)};
  Result<std::unique_ptr<Input>> mixed = open_input(arguments);
  ASSERT_TRUE(mixed.ok());
  EXPECT_TRUE(mixed.value()->read_frame(1, positions).ok());
}

TEST(Input, IsolatedVerticesAreReported) {
  const TemporaryFolder folder;
  const std::string mixed =
      folder.write("mixed.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nv 6 6 6\nf 1 2 3\nl 4 1\n");
  const std::string points = folder.write("points.obj", "v 0 0 0\nv 1 0 0\np 1 2\n");
  for (const auto& [path, count] : {std::pair(mixed, "1 of 5"), std::pair(points, "2 of 2")}) {
    const Arguments arguments{path, path};
    const Result<std::unique_ptr<Input>> input = open_input(arguments);
    ASSERT_TRUE(input.ok()) << input.error().message;
    EXPECT_THAT(
        input.value()->notes(),
        ElementsAre(HasSubstr(std::string(": vertices in no face and no edge: ") + count + "; as points")));
  }
}

TEST(Input, EdgesComeWithTheMesh) {
  const TemporaryFolder folder;
  const std::string first = folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2 3\n");
  const std::string second = folder.write("b.ply",
                                          "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\n"
                                          "property double y\nproperty double z\nelement edge 2\n"
                                          "property uchar red\nproperty int vertex2\nproperty uint vertex1\n"
                                          "end_header\n0 0 1\n1 0 1\n2 0 1\n9 1 0\n9 2 1\n");
  const std::string other = folder.write("c.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2\nl 3 1\n");
  const std::string fewer = folder.write("d.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2\n");
  const Arguments arguments{first, second, other, fewer};
  Result<std::unique_ptr<Input>> input = open_input(arguments);
  ASSERT_TRUE(input.ok()) << input.error().message;
  using Edge = std::array<std::int32_t, 2>;
  EXPECT_THAT(input.value()->scene().edges, ElementsAre(Edge{0, 1}, Edge{1, 2}));
  EXPECT_THAT(input.value()->notes(), IsEmpty());
  PositionBuffer positions;
  EXPECT_TRUE(input.value()->read_frame(1, positions).ok());
  EXPECT_THAT(input.value()->read_frame(2, positions).error().message, HasSubstr("another topology than"));
  EXPECT_THAT(input.value()->read_frame(3, positions).error().message, HasSubstr(": 1 edges, not 2"));
  // A scene's folder holds them, too.
  const Mesh mesh{std::vector<float>{0, 0, 0, 1, 0, 0}, {}, {}, {{1, 0}}};
  const Result<Mesh> again = parse_ply(format_ply(mesh, ""), "again.ply");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again.value().edges, mesh.edges);
}

TEST(Input, EdgesThatAreNoneAreRefused) {
  const auto obj = [](const std::string& lines) {
    const Result<Mesh> mesh = parse_obj("v 0 0 0\nv 1 0 0\n" + lines, "a.obj");
    return mesh ? std::string() : mesh.error().message;
  };
  EXPECT_THAT(obj("l 1\n"), HasSubstr("a.obj: line 3: a line needs two vertices, this one has 1"));
  EXPECT_THAT(obj("l 1 2 2\n"), HasSubstr("line 3: the line joins vertex 2 to itself"));
  EXPECT_THAT(obj("l 1 x\n"), HasSubstr("line 3: line vertex 'x' is no index"));
  EXPECT_THAT(obj("l 1 3\n"), HasSubstr("line 3: vertex index 3, but the file has 2 vertices"));
  const auto ply = [](const std::string& properties, const std::string& edge) {
    const Result<Mesh> mesh = parse_ply(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n"
        "property float y\nproperty float z\nelement edge 1\n" +
            properties + "end_header\n0 0 0\n1 0 0\n" + edge + "\n",
        "a.ply");
    return mesh ? std::string() : mesh.error().message;
  };
  const std::string ends = "property int vertex1\nproperty int vertex2\n";
  EXPECT_EQ(ply(ends, "0 1"), "");
  EXPECT_THAT(ply(ends, "1 1"), HasSubstr("edge 0: it joins vertex 1 to itself"));
  EXPECT_THAT(ply(ends, "0 2"), HasSubstr("edge 0: vertex index 2 is not a whole number in [0, 2)"));
  EXPECT_THAT(ply("property int vertex1\n", "0"),
              HasSubstr("element 'edge' has no scalar property 'vertex2'"));
}

TEST(Input, MeshFilesMustShareTheirTopology) {
  const TemporaryFolder folder;
  const std::string a = folder.write("a.ply", triangle(0));
  const std::string same = folder.write("b.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n");
  const std::string turned = folder.write("c.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 3 2\n");
  const std::string larger = folder.write("d.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\nv 9 9 9\nf 1 2 3\n");
  const std::string fuller = folder.write("e.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\nf 1 2 3\n");
  const auto second_frame = [&](const std::string& path) -> std::string {
    const Arguments arguments{a, path};
    Result<std::unique_ptr<Input>> input = open_input(arguments);
    if (!input) return input.error().message;
    PositionBuffer positions;
    const Status status = input.value()->read_frame(1, positions);
    return status ? "" : status.error().message;
  };
  EXPECT_EQ(second_frame(same), "");
  EXPECT_THAT(second_frame(turned), HasSubstr("triangle 0 is (0, 2, 1), not (0, 1, 2)"));
  EXPECT_THAT(second_frame(larger), HasSubstr("4 vertices, not 3"));
  EXPECT_THAT(second_frame(fuller), HasSubstr("2 triangles, not 1"));
  EXPECT_THAT(second_frame(folder.file("missing.stl")), HasSubstr("missing.stl: cannot open"));
}

TEST(Input, BuiltinsGiveTheSameBitsInAnyOrder) {
  const Arguments arguments{"builtin:cloth-ball?triangles=1000&frames=6"};
  Result<std::unique_ptr<Input>> a = open_input(arguments);
  Result<std::unique_ptr<Input>> b = open_input(arguments);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a.value()->frame_count(), 6U);
  PositionBuffer forward, back;
  std::vector<PositionBuffer> frames;
  for (std::uint32_t i = 0; i < 6; ++i) {
    ASSERT_TRUE(a.value()->read_frame(i, forward).ok());
    frames.push_back(forward);
  }
  for (std::uint32_t i = 6; i-- > 0;) {
    ASSERT_TRUE(b.value()->read_frame(i, back).ok());
    EXPECT_EQ(back, frames[i]) << i;
  }
  EXPECT_FALSE(a.value()->read_frame(6, forward).ok());
}

/// The real data, where it is.
std::string data_folder(const char* name) {
  const char* given = std::getenv("WARMFRONT_DATA");
  return (std::filesystem::path(given ? given : WARMFRONT_DEFAULT_DATA) / name).string();
}

TEST(Input, ReadsTheRealSequencesAndFrames) {
  struct Expected {
    const char* folder;
    std::uint32_t vertices;
    std::size_t triangles;
    std::uint32_t frames;
    std::size_t bodies;
  };
  const std::vector<Expected> all{{"frames/cloth-ball", 46'598, 92'230, 2, 0},
                                  {"sequences/cloth-ball-10k", 5'127, 9'976, 76, 2},
                                  {"sequences/flamenco", 24'881, 49'000, 58, 6},
                                  {"sequences/bart-like", 2'228, 4'344, 70, 28}};
  for (const Expected& e : all) {
    const Arguments arguments{data_folder(e.folder)};
    if (!std::filesystem::exists(arguments[0]))
      GTEST_SKIP() << arguments[0] << " is absent; set WARMFRONT_DATA";
    Result<std::unique_ptr<Input>> input = open_input(arguments);
    ASSERT_TRUE(input.ok()) << input.error().message;
    EXPECT_EQ(input.value()->scene().vertex_count, e.vertices);
    EXPECT_EQ(input.value()->scene().faces.size(), e.triangles);
    EXPECT_EQ(input.value()->frame_count(), e.frames);
    EXPECT_EQ(input.value()->scene().bodies.size(), e.bodies) << e.folder;
    PositionBuffer positions;
    ASSERT_TRUE(input.value()->read_frame(e.frames - 1, positions).ok());
    EXPECT_EQ(vertex_count(positions), e.vertices);
  }
}

}  // namespace
}  // namespace warmfront::client
