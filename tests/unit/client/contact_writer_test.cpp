// SPDX-License-Identifier: Apache-2.0
// Contact files: columns and fields to the letter, values that come back as the same bits, disk errors that
// show.
#include "client/io/contact_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "client/io/endian.h"
#include "client/io/file.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;

const std::vector<ContactRecord> kContacts{
    {ContactKind::kVertexFace, ContactStatus::kHit, {5, 1, 2, 3}, 0.1},
    {ContactKind::kEdgeEdge, ContactStatus::kPossible, {0, 4, 1, 2}, 0},
};
const std::vector<double> kStart(18, 0.0);
const std::vector<double> kEnd(18, 1.0);

void write_two_frames(const std::string& path) {
  Result<std::unique_ptr<ContactWriter>> writer = open_contact_writer(path);
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  ASSERT_TRUE(writer.value()->write(1, std::span(kStart), std::span(kEnd), kContacts, {}).ok());
  ASSERT_TRUE(writer.value()->write(12, std::span(kStart), std::span(kEnd), {}, {}).ok());
  ASSERT_TRUE(
      writer.value()->write(13, std::span(kStart), std::span(kEnd), std::span(kContacts).first(1), {}).ok());
  ASSERT_TRUE(writer.value()->close().ok());
}

TEST(ContactWriter, CsvHasTheColumnsThatToolsRead) {
  const TemporaryFolder folder;
  write_two_frames(folder.file("c.csv"));
  EXPECT_EQ(folder.read("c.csv"),
            "frame,type,v0,v1,v2,v3,toi,status\n"
            "1,vf,5,1,2,3,0.10000000000000001,hit\n"
            "1,ee,0,4,1,2,0,possible\n"
            "13,vf,5,1,2,3,0.10000000000000001,hit\n");
}

// It is a body, and there may be more bodies than vertices.
TEST(ContactWriter, TheNumberOfAHalfSpaceIsNoVertex) {
  const TemporaryFolder folder;
  const std::vector<ContactRecord> rows{
      {ContactKind::kVertexHalfSpace, ContactStatus::kHit, {5, 5, 5, 1'000'000}, 0.5}};
  for (const char* name : {"c.csv", "c.jsonl", "c.vtp"}) {
    auto writer = open_contact_writer(folder.file(name));
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    ASSERT_TRUE(writer.value()->write(1, std::span(kStart), std::span(kEnd), rows, {}).ok());
    ASSERT_TRUE(writer.value()->close().ok());
  }
  EXPECT_EQ(folder.read("c.csv"),
            "frame,type,v0,v1,v2,v3,toi,status\n"
            "1,vh,5,5,5,1000000,0.5,hit\n");
  EXPECT_THAT(folder.read("c.jsonl"), HasSubstr("\"type\":\"vh\",\"v0\":5,\"v1\":5,\"v2\":5,\"v3\":1000000"));
}

TEST(ContactWriter, JsonLinesAreObjectsOfTheSameFieldsAndTheStatus) {
  const TemporaryFolder folder;
  write_two_frames(folder.file("c.jsonl"));
  std::istringstream lines(folder.read("c.jsonl"));
  std::string line;
  std::vector<nlohmann::json> objects;
  while (std::getline(lines, line)) objects.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(objects.size(), 3U);
  EXPECT_EQ(objects[0],
            nlohmann::json::parse(
                R"({"frame":1,"type":"vf","v0":5,"v1":1,"v2":2,"v3":3,"toi":0.1,"status":"hit"})"));
  EXPECT_EQ(objects[1]["status"], "possible");
  EXPECT_EQ(objects[2]["frame"], 13);
}

TEST(ContactWriter, VtpPointsLieWhereTheContactsAre) {
  const TemporaryFolder folder;
  write_two_frames(folder.file("c.vtp"));
  const std::string index = folder.read("c.pvd");
  for (const char* name : {"c_000001.vtp", "c_000012.vtp", "c_000013.vtp"}) {
    EXPECT_THAT(index, HasSubstr("file=\"" + std::string(name) + "\""));
    EXPECT_FALSE(folder.read(name).empty());
  }
  const std::string vtp = folder.read("c_000001.vtp");
  EXPECT_THAT(vtp, HasSubstr("NumberOfPoints=\"2\" NumberOfVerts=\"2\""));
  // The arrays in their order: toi (2 doubles) comes first, with its size before it.
  ASSERT_THAT(vtp, HasSubstr("\n_"));
  const std::size_t data = vtp.find("\n_") + 2;
  EXPECT_EQ(load_scalar<std::uint64_t>(&vtp[data], std::endian::little), 16U);
  EXPECT_EQ(load_scalar<double>(&vtp[data + 8], std::endian::little), 0.1);
  const std::size_t at = vtp.find("Name=\"Points\"");
  const std::size_t offset = std::strtoul(&vtp[vtp.find("offset=\"", at) + 8], nullptr, 10);
  EXPECT_EQ(load_scalar<std::uint64_t>(&vtp[data + offset], std::endian::little), 48U);
  const std::size_t ids = vtp.find("Name=\"vertices\" NumberOfComponents=\"4\"");
  ASSERT_NE(ids, std::string::npos) << "which bodies touch";
  const std::size_t ids_offset = std::strtoul(&vtp[vtp.find("offset=\"", ids) + 8], nullptr, 10);
  EXPECT_EQ(load_scalar<std::uint64_t>(&vtp[data + ids_offset], std::endian::little), 32U);
  for (std::size_t k = 0; k < 8; ++k)
    EXPECT_EQ(load_scalar<std::uint32_t>(&vtp[data + ids_offset + 8 + 4 * k], std::endian::little),
              kContacts[k / 4].vertices[k % 4]);
  // From 0 to 1 along each axis, at toi 0.1.
  EXPECT_DOUBLE_EQ(load_scalar<double>(&vtp[data + offset + 8], std::endian::little), 0.1);
  EXPECT_DOUBLE_EQ(load_scalar<double>(&vtp[data + offset + 8 + 24], std::endian::little), 0.0);
}

TEST(ContactWriter, FieldsAskedForFollow) {
  const TemporaryFolder folder;
  ContactGeometry geometry;
  geometry.weights = {1, 0.25, 0.25, 0.5};
  geometry.normal = {0, 0, 1};
  geometry.points = {1, 2, 3, 4, 5, 6};
  geometry.direction = {0, 1, 0};
  geometry.squared_distance = 0.25;
  geometry.closest = ClosestFeatures::kFaceVertex;
  const std::vector<ContactGeometry> both(2, geometry);
  for (const char* name : {"c.csv", "c.jsonl", "c.vtp"}) {
    auto writer = open_contact_writer(folder.file(name), ContactFields{.weights = true,
                                                                       .normal = true,
                                                                       .points = true,
                                                                       .direction = true,
                                                                       .squared_distance = true,
                                                                       .closest = true});
    ASSERT_TRUE(writer.value()->write(1, std::span(kStart), std::span(kEnd), kContacts, both).ok());
    ASSERT_TRUE(writer.value()->close().ok());
  }
  EXPECT_THAT(
      folder.read("c.csv"),
      HasSubstr("toi,status,w0,w1,w2,w3,nx,ny,nz,ax,ay,az,bx,by,bz,dx,dy,dz,squared_distance,closest\n"
                "1,vf,5,1,2,3,0.10000000000000001,hit,1,0.25,0.25,0.5,0,0,1,1,2,3,4,5,6,0,1,0,0.25,fv\n"));
  std::istringstream lines(folder.read("c.jsonl"));
  std::string line;
  std::getline(lines, line);
  const auto object = nlohmann::json::parse(line);
  EXPECT_EQ(object["weights"], nlohmann::json::parse("[1, 0.25, 0.25, 0.5]"));
  EXPECT_EQ(object["normal"], nlohmann::json::parse("[0, 0, 1]"));
  EXPECT_EQ(object["points"], nlohmann::json::parse("[[1, 2, 3], [4, 5, 6]]"));
  EXPECT_EQ(object["direction"], nlohmann::json::parse("[0, 1, 0]"));
  EXPECT_EQ(object["squared_distance"], 0.25);
  EXPECT_EQ(object["closest"], "fv");
  const std::string vtp = folder.read("c_000001.vtp");
  EXPECT_THAT(vtp, HasSubstr("Name=\"point_b\" NumberOfComponents=\"3\""));
  EXPECT_THAT(vtp, HasSubstr("Name=\"closest\""));
}

TEST(ContactWriter, SaysWhatIsNewAndWhatEnded) {
  const TemporaryFolder folder;
  WrittenFields fields = ContactFields{.weights = true};
  fields.continuity = true;
  std::vector<ContactRecord> contacts = kContacts;
  contacts[0].continuity = RowContinuity::kKept;
  contacts.push_back({ContactKind::kVertexFace, ContactStatus::kHit, {4, 1, 2, 3}, 0.5});
  contacts.back().continuity = RowContinuity::kEnded;
  ContactGeometry geometry;
  geometry.weights = {1, 0.25, 0.25, 0.5};
  const std::vector<ContactGeometry> of_two(2, geometry);
  for (const char* name : {"c.csv", "c.jsonl", "c.vtp"}) {
    auto writer = open_contact_writer(folder.file(name), fields);
    const std::size_t rows = std::string_view(name).ends_with(".vtp") ? 2 : 3;
    const std::span<const ContactRecord> told = std::span(contacts).first(rows);
    ASSERT_TRUE(writer.value()->write(1, std::span(kStart), std::span(kEnd), told, of_two).ok());
    ASSERT_TRUE(writer.value()->close().ok());
  }
  EXPECT_EQ(folder.read("c.csv"),
            "frame,type,v0,v1,v2,v3,toi,status,w0,w1,w2,w3,continuity\n"
            "1,vf,5,1,2,3,0.10000000000000001,hit,1,0.25,0.25,0.5,kept\n"
            "1,ee,0,4,1,2,0,possible,1,0.25,0.25,0.5,new\n"
            "1,vf,4,1,2,3,,,,,,,ended\n");
  EXPECT_THAT(folder.read("c.jsonl"), HasSubstr(",\"weights\":[1,0.25,0.25,0.5],\"continuity\":\"kept\"}"));
  EXPECT_THAT(
      folder.read("c.jsonl"),
      HasSubstr(
          "{\"frame\":1,\"type\":\"vf\",\"v0\":4,\"v1\":1,\"v2\":2,\"v3\":3,\"continuity\":\"ended\"}"));
  EXPECT_THAT(folder.read("c_000001.vtp"), HasSubstr("Name=\"continuity\""));
}

TEST(ContactWriter, UnknownExtensionsAndUnwritableFilesFail) {
  const TemporaryFolder folder;
  EXPECT_FALSE(is_contact_file_name("c.txt"));
  EXPECT_THAT(open_contact_writer("c.txt").error().message, HasSubstr(".csv, .jsonl or .vtp"));
  for (const char* name : {"missing/c.csv", "missing/c.jsonl", "missing/c.vtp"})
    EXPECT_THAT(open_contact_writer(folder.file(name)).error().message, HasSubstr("No such file")) << name;
}

TEST(ContactWriter, AFullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/full", folder.file("c.csv"));
  Result<std::unique_ptr<ContactWriter>> writer = open_contact_writer(folder.file("c.csv"));
  ASSERT_TRUE(writer.ok());
  EXPECT_FALSE(writer.value()->write(1, std::span(kStart), std::span(kEnd), kContacts, {}).ok());
  EXPECT_THAT(writer.value()->close().error().message, HasSubstr("No space left"));
}

RC_GTEST_PROP(ContactWriter, TimesComeBackAsTheSameBits, (double toi)) {
  std::string text;
  append_round_trip(text, toi);
  RC_ASSERT(std::strtod(text.c_str(), nullptr) == toi);
}

}  // namespace
}  // namespace warmfront::client
