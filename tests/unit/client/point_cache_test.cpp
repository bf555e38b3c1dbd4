// SPDX-License-Identifier: Apache-2.0
// MDD and numpy's files: round trips, byte orders, truncation, hostile headers.
#include "client/io/point_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/endian.h"
#include "client/io/mdd.h"
#include "client/io/npy.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class T>
std::string in_order(T value, std::endian order) {
  std::string bytes;
  append_little(bytes, value);
  if (order == std::endian::big) std::ranges::reverse(bytes);
  return bytes;
}

std::string mdd_bytes(std::int32_t frames, std::int32_t points, std::size_t numbers) {
  std::string bytes = in_order(frames, std::endian::big) + in_order(points, std::endian::big);
  for (std::size_t i = 0; i < numbers; ++i) bytes += in_order(static_cast<float>(i), std::endian::big);
  return bytes;
}

std::string open_error(const TemporaryFolder& folder, const std::string& name, std::string_view bytes) {
  const auto cache = open_point_cache(folder.write(name, bytes));
  return cache ? "" : cache.error().message;
}

TEST(Mdd, FramesComeBackInAnyOrder) {
  const TemporaryFolder folder;
  const std::vector<std::vector<float>> frames{
      {0, 1, 2, 3, 4, 5}, {6, 7, 8, 9, 10, 11}, {-1, -2, -3, -4, -5, -6}};
  Result<MddWriter> writer = MddWriter::create(folder.file("c.mdd"), {3, 2}, 0.5);
  ASSERT_TRUE(writer.ok());
  for (const auto& frame : frames) writer.value().append(frame);
  ASSERT_TRUE(writer.value().close().ok());
  const std::string bytes = folder.read("c.mdd");
  EXPECT_EQ(bytes.size(), 8U + 3 * 4 + 3 * 2 * 12);
  EXPECT_EQ(load_scalar<float>(bytes.data() + 12, std::endian::big), 0.5f) << "the second frame's time";

  Result<MddReader> reader = MddReader::open(folder.file("c.mdd"));
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  std::vector<float> positions;
  for (const std::uint32_t i : {2U, 0U, 1U, 1U}) {
    ASSERT_TRUE(reader.value().read(i, positions).ok());
    EXPECT_EQ(positions, frames[i]);
  }
  EXPECT_FALSE(reader.value().read(3, positions).ok());
  const auto cache = open_point_cache(folder.file("c.mdd"));
  ASSERT_TRUE(cache.ok());
  EXPECT_EQ(cache.value()->frame_count(), 3U);
  EXPECT_EQ(cache.value()->point_count(), 2U);
  PositionBuffer buffer = std::vector<double>{1};
  ASSERT_TRUE(cache.value()->read(1, buffer).ok());
  EXPECT_EQ(std::get<0>(buffer), frames[1]);
}

TEST(Mdd, TheWriterHoldsTheHeaderToItsWord) {
  const TemporaryFolder folder;
  Result<MddWriter> writer = MddWriter::create(folder.file("c.mdd"), {2, 1}, 1);
  ASSERT_TRUE(writer.ok());
  writer.value().append(std::vector<float>{1, 2, 3});
  EXPECT_FALSE(writer.value().close().ok());
}

TEST(Mdd, WhatIsNotAsLongAsItSaysIsRefused) {
  const TemporaryFolder folder;
  const std::string whole = mdd_bytes(2, 2, 2 + 12);
  EXPECT_EQ(open_error(folder, "c.mdd", whole), "");
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_NE(open_error(folder, "c.mdd", std::string_view(whole).substr(0, size)), "") << "cut at " << size;
  EXPECT_THAT(open_error(folder, "c.mdd", whole + "x"), HasSubstr("no MDD of 2 frames of 2 points"));
  EXPECT_THAT(open_error(folder, "c.mdd", mdd_bytes(-1, 2, 0)), HasSubstr("byte 0: -1 frames"));
  EXPECT_THAT(open_error(folder, "c.mdd", mdd_bytes(1, -2, 0)), HasSubstr("byte 4: -2 points"));
  EXPECT_THAT(open_error(folder, "c.mdd", mdd_bytes(0x7fffffff, 0x7fffffff, 9)), HasSubstr("no MDD of"));
  std::string little;  // the other byte order gives numbers that do not fit
  append_little(little, std::int32_t{2});
  append_little(little, std::int32_t{2});
  EXPECT_THAT(open_error(folder, "c.mdd", little + whole.substr(8)), HasSubstr("no MDD of 33554432 frames"));
}

/// As numpy writes it.
std::string npy_bytes(const std::string& type, const std::string& shape, const std::string& data,
                      const std::string& fortran = "False", int version = 1) {
  std::string dictionary =
      "{'descr': '" + type + "', 'fortran_order': " + fortran + ", 'shape': " + shape + ", }";
  const std::size_t before = version == 1 ? 10 : 12;
  dictionary.append(63 - (before + dictionary.size()) % 64, ' ');
  dictionary += '\n';
  std::string bytes("\x93NUMPY", 6);
  bytes += static_cast<char>(version);
  bytes += '\0';
  if (version == 1)
    append_little(bytes, static_cast<std::uint16_t>(dictionary.size()));
  else
    append_little(bytes, static_cast<std::uint32_t>(dictionary.size()));
  return bytes + dictionary + data;
}

template <class T>
std::string numbers(const std::vector<double>& values, std::endian order = std::endian::little) {
  std::string bytes;
  for (const double value : values) bytes += in_order(static_cast<T>(value), order);
  return bytes;
}

const std::vector<double> kTwoFrames{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};

TEST(Npy, PositionsOfEveryTypeAndOrder) {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::string>> files{
      {"<f4", numbers<float>(kTwoFrames)},
      {">f4", numbers<float>(kTwoFrames, std::endian::big)},
      {"<f8", numbers<double>(kTwoFrames)},
      {">f8", numbers<double>(kTwoFrames, std::endian::big)}};
  for (const auto& [type, data] : files) {
    for (const int version : {1, 2, 3}) {
      const auto cache =
          open_point_cache(folder.write("c.npy", npy_bytes(type, "(2, 2, 3)", data, "False", version)));
      ASSERT_TRUE(cache.ok()) << type << ": " << cache.error().message;
      EXPECT_EQ(cache.value()->frame_count(), 2U);
      EXPECT_EQ(cache.value()->point_count(), 2U);
      PositionBuffer positions;
      ASSERT_TRUE(cache.value()->read(1, positions).ok());
      EXPECT_EQ(positions.index(), type[2] == '8' ? 1U : 0U) << "in the file's precision";
      for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(coordinate(view(positions), i), kTwoFrames[6 + i]);
      EXPECT_FALSE(cache.value()->read(2, positions).ok());
    }
  }
}

TEST(Npy, WhatIsNoSequenceOfPositionsIsRefused) {
  const TemporaryFolder folder;
  const std::string data = numbers<float>(kTwoFrames);
  const auto error = [&](const std::string& bytes) { return open_error(folder, "c.npy", bytes); };
  const std::string whole = npy_bytes("<f4", "(2, 2, 3)", data);
  EXPECT_EQ(error(whole), "");
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_NE(error(whole.substr(0, size)), "") << "cut at " << size;
  EXPECT_THAT(error(npy_bytes("<f4", "(2, 2, 3)", data, "True")), HasSubstr("save numpy.ascontiguousarray"));
  EXPECT_THAT(error(npy_bytes("<f4", "(4, 3)", data)), HasSubstr("(4, 3) of <f4; positions are expected"));
  EXPECT_THAT(error(npy_bytes("<f4", "(12,)", data)), HasSubstr("(12,) of <f4; positions are expected"));
  EXPECT_THAT(error(npy_bytes("<f4", "(3, 2, 2)", data)), HasSubstr("positions are expected"));
  EXPECT_THAT(error(npy_bytes("<i4", "(2, 2, 3)", data)), HasSubstr("positions are expected"));
  EXPECT_THAT(error(npy_bytes("<f2", "(2, 2, 3)", data)),
              HasSubstr("float32, float64 and integers are read"));
  EXPECT_THAT(error(npy_bytes("<c8", "(2, 2, 3)", data)),
              HasSubstr("float32, float64 and integers are read"));
  EXPECT_THAT(error(npy_bytes("|O", "(2, 2, 3)", data)), HasSubstr("float32, float64 and integers are read"));
  EXPECT_THAT(error(npy_bytes("<f4", "(2, 3, 3)", data)), HasSubstr("the array ends here"));
  EXPECT_THAT(error(npy_bytes("<f4", "(4294967296, 4294967296, 3)", data)), HasSubstr("the array ends here"));
  EXPECT_THAT(error(npy_bytes("<f4", "(-1, 2, 3)", data)), HasSubstr("no shape"));
  EXPECT_THAT(error(npy_bytes("<f4", "(2, 99999999999999999999, 3)", data)), HasSubstr("no shape"));
  EXPECT_THAT(error("ply" + whole), HasSubstr("must start with '\\x93NUMPY'"));
}

struct Entry {
  std::string name;
  std::string data;
  int method = 0;
};

/// A ZIP archive as numpy.savez writes it; `wide` with sizes and places in ZIP64's fields, as of more than 4
/// GiB.
std::string zip_bytes(const std::vector<Entry>& entries, bool wide = false, const std::string& comment = "") {
  std::string archive, directory;
  const auto put16 = [](std::string& to, std::size_t value) {
    append_little(to, static_cast<std::uint16_t>(value));
  };
  const auto put32 = [](std::string& to, std::size_t value) {
    append_little(to, static_cast<std::uint32_t>(value));
  };
  const auto put64 = [](std::string& to, std::size_t value) {
    append_little(to, static_cast<std::uint64_t>(value));
  };
  for (const Entry& entry : entries) {
    const std::size_t at = archive.size(), size = entry.data.size();
    archive += std::string("PK\3\4\x2d\0\0\0", 8);
    put16(archive, static_cast<std::size_t>(entry.method));
    archive += std::string(8, '\0');  // time and check sum
    put32(archive, 0xffffffff);
    put32(archive, 0xffffffff);
    put16(archive, entry.name.size());
    put16(archive, 20);
    archive += entry.name;
    put16(archive, 1);
    put16(archive, 16);
    put64(archive, size);
    put64(archive, size);
    archive += entry.data;
    directory += std::string("PK\1\2\x2d\3\x2d\0\0\0", 10);
    put16(directory, static_cast<std::size_t>(entry.method));
    directory += std::string(8, '\0');
    put32(directory, wide ? 0xffffffff : size);
    put32(directory, wide ? 0xffffffff : size);
    put16(directory, entry.name.size());
    put16(directory, wide ? 28 : 0);
    directory += std::string(10, '\0');
    put32(directory, wide ? 0xffffffff : at);
    directory += entry.name;
    if (!wide) continue;
    put16(directory, 1);
    put16(directory, 24);
    put64(directory, size);
    put64(directory, size);
    put64(directory, at);
  }
  const std::size_t at = archive.size();
  archive += directory;
  if (wide) {
    const std::size_t end = archive.size();
    archive += "PK\6\6";
    put64(archive, 44);
    archive += std::string(12, '\0');
    put64(archive, entries.size());
    put64(archive, entries.size());
    put64(archive, directory.size());
    put64(archive, at);
    archive += "PK\6\7";
    put32(archive, 0);
    put64(archive, end);
    put32(archive, 1);
  }
  archive += std::string("PK\5\6\0\0\0\0", 8);
  for (int twice = 0; twice < 2; ++twice) put16(archive, wide ? 0xffff : entries.size());
  put32(archive, wide ? 0xffffffff : directory.size());
  put32(archive, wide ? 0xffffffff : at);
  put16(archive, comment.size());
  return archive + comment;
}

std::vector<Entry> arrays() {
  return {{"positions.npy", npy_bytes("<f4", "(2, 2, 3)", numbers<float>(kTwoFrames))},
          {"readme.txt", "not an array"},
          {"faces.npy", npy_bytes("<i8", "(1, 3)", numbers<std::int64_t>({0, 1, 1}))}};
}

TEST(Npz, MembersAreFound) {
  const TemporaryFolder folder;
  for (const bool wide : {false, true}) {
    for (const std::string& comment : {std::string(), std::string("PK\5"), std::string(0xffff, 'c')}) {
      const std::string path = folder.write("a.npz", zip_bytes(arrays(), wide, comment));
      const Result<std::vector<NpzMember>> members = list_npz(path);
      ASSERT_TRUE(members.ok()) << members.error().message;
      ASSERT_EQ(members.value().size(), 2U) << "arrays alone";
      EXPECT_EQ(members.value()[0].name, "positions");
      const NpzMember& faces = members.value()[1];
      EXPECT_EQ(faces.name, "faces");
      Result<NpyArray> array = NpyArray::open(path, "faces", faces.at, faces.size);
      ASSERT_TRUE(array.ok()) << array.error().message;
      std::vector<std::array<std::int32_t, 3>> rows;
      ASSERT_TRUE(array.value().read_rows(rows).ok());
      EXPECT_THAT(rows, ElementsAre(std::array<std::int32_t, 3>{0, 1, 1}));
    }
  }
}

TEST(Npz, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  for (const bool wide : {false, true}) {
    const std::string whole = zip_bytes(arrays(), wide);
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_FALSE(list_npz(folder.write("a.npz", std::string_view(whole).substr(0, size))).ok())
          << "cut at " << size;
  }
}

TEST(Npz, WhatCannotBeReadByFramesIsRefused) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& bytes) {
    const auto members = list_npz(folder.write("a.npz", bytes));
    return members ? "" : members.error().message;
  };
  std::vector<Entry> compressed = arrays();
  compressed[0].method = 8;
  EXPECT_THAT(error(zip_bytes(compressed)), HasSubstr("'positions.npy' is compressed"));
  EXPECT_THAT(error(zip_bytes(compressed)), HasSubstr("numpy.savez"));
  EXPECT_THAT(error(npy_bytes("<f4", "(1,)", "abcd")), HasSubstr("no .npz"));
  std::string far = zip_bytes(arrays());
  far[far.size() - 4] = '\x7f';  // the directory's place
  EXPECT_THAT(error(far), HasSubstr("no directory of 3 members"));
  std::string many = zip_bytes(arrays());
  many[many.size() - 12] = '\x7f';  // how many members there are
  EXPECT_THAT(error(many), HasSubstr("no directory of 127 members"));
}

TEST(Npz, IndicesOfEveryType) {
  const TemporaryFolder folder;
  const auto rows_of = [&](const std::string& bytes) -> std::string {
    Result<NpyArray> array = NpyArray::open(folder.write("i.npy", bytes));
    if (!array) return array.error().message;
    std::vector<std::array<std::int32_t, 2>> rows;
    if (Status status = array.value().read_rows(rows); !status) return status.error().message;
    return std::to_string(rows.at(0)[0]) + " " + std::to_string(rows.at(0)[1]);
  };
  const std::vector<double> values{3, 120};
  EXPECT_EQ(rows_of(npy_bytes("|i1", "(1, 2)", numbers<std::int8_t>(values))), "3 120");
  EXPECT_EQ(rows_of(npy_bytes("|u1", "(1, 2)", numbers<std::uint8_t>(values))), "3 120");
  EXPECT_EQ(rows_of(npy_bytes("<i2", "(1, 2)", numbers<std::int16_t>(values))), "3 120");
  EXPECT_EQ(rows_of(npy_bytes(">u2", "(1, 2)", numbers<std::uint16_t>(values, std::endian::big))), "3 120");
  EXPECT_EQ(rows_of(npy_bytes("<i4", "(1, 2)", numbers<std::int32_t>(values))), "3 120");
  EXPECT_EQ(rows_of(npy_bytes("<u4", "(1, 2)", numbers<std::uint32_t>(values))), "3 120");
  EXPECT_EQ(rows_of(npy_bytes(">i8", "(1, 2)", numbers<std::int64_t>(values, std::endian::big))), "3 120");
  EXPECT_EQ(rows_of(npy_bytes("<u8", "(1, 2)", numbers<std::uint64_t>(values))), "3 120");
  EXPECT_THAT(rows_of(npy_bytes("<i4", "(1, 2)", numbers<std::int32_t>({3, -1}))),
              HasSubstr("[0, 1] is no vertex's"));
  EXPECT_THAT(rows_of(npy_bytes("<u4", "(1, 2)", numbers<std::uint32_t>({4e9, 1}))),
              HasSubstr("[0, 0] is no vertex's"));
  EXPECT_THAT(rows_of(npy_bytes("<u8", "(1, 2)", std::string(16, '\xff'))), HasSubstr("is no vertex's"));
  EXPECT_THAT(rows_of(npy_bytes("<i4", "(2, 1)", numbers<std::int32_t>(values))),
              HasSubstr("the shape (any, 2)"));
  EXPECT_THAT(rows_of(npy_bytes("<f4", "(1, 2)", numbers<float>(values))), HasSubstr("integers"));
}

}  // namespace
}  // namespace warmfront::client
