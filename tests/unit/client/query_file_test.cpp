// SPDX-License-Identifier: Apache-2.0
// Query files: every double survives, everything else is named by its line.
#include "client/io/query_file.h"

#include <gmock/gmock.h>
#include <gmpxx.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include "client/io/file.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;

std::string row(const std::string& x, const std::string& truth = "1") {
  return x + ",0,1,0,1," + truth + "\n";
}

// One query whose first coordinate is the fraction.
std::string query_with(const std::string& fraction) {
  std::string text = row(fraction);
  for (int k = 0; k < 7; ++k) text += row("0,1");
  return text;
}

std::string message_for(const std::string& text) {
  const auto parsed = parse_queries(text, "file.csv");
  return parsed ? "" : parsed.error().message;
}

double value_of(const std::string& fraction) {
  const auto parsed = parse_queries(query_with(fraction), "file.csv");
  EXPECT_TRUE(parsed.ok()) << fraction;
  return parsed ? parsed.value()[0].vertices[0].t0[0] : std::nan("");
}

std::string power_of_two(unsigned n) {
  return mpz_class(mpz_class(1) << n).get_str();
}

TEST(QueryFile, RowsAreVerticesAtBothEnds) {
  std::string text;
  for (int k = 0; k < 16; ++k) {
    text += std::to_string(k) + ",1," + std::to_string(k) + ",2,-" + std::to_string(k) + ",4," +
            (k < 8 ? "1" : "0") + "\r\n";
  }
  const auto parsed = parse_queries(text, "file.csv");
  ASSERT_TRUE(parsed.ok()) << parsed.error().message;
  ASSERT_EQ(parsed.value().size(), 2U);
  EXPECT_TRUE(parsed.value()[0].truth);
  EXPECT_FALSE(parsed.value()[1].truth);
  for (int k = 0; k < 4; ++k) {
    const VertexMotion& v = parsed.value()[1].vertices[k];
    EXPECT_EQ(v.t0, (std::array<double, 4>{8.0 + k, (8 + k) / 2.0, -(8 + k) / 4.0, 0}));
    EXPECT_EQ(v.t1, (std::array<double, 4>{12.0 + k, (12 + k) / 2.0, -(12 + k) / 4.0, 0}));
  }
}

TEST(QueryFile, FractionsAreDoublesFromTheSmallestToTheLargest) {
  EXPECT_EQ(value_of("1," + power_of_two(1074)), std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(value_of("-3," + power_of_two(1074)), -3 * std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(value_of(power_of_two(1023) + ",1"), 0x1p1023);
  EXPECT_EQ(value_of("+7,1"), 7);
  EXPECT_EQ(value_of("-0,5"), 0);
  EXPECT_EQ(value_of("3,6"), 0.5);
  EXPECT_EQ(value_of("3,-6"), -0.5);
  EXPECT_EQ(value_of(power_of_two(1100) + "," + power_of_two(1101)), 0.5);
  EXPECT_THAT(message_for(query_with("1,3")), HasSubstr("file.csv: line 1: x is not exactly a double"));
  EXPECT_THAT(message_for(query_with("1," + power_of_two(1075))), HasSubstr("not exactly a double"));
  EXPECT_THAT(message_for(query_with(power_of_two(1024) + ",1")), HasSubstr("not exactly a double"));
  EXPECT_THAT(message_for(query_with("9007199254740993,1")), HasSubstr("not exactly a double"));
  EXPECT_THAT(message_for(query_with("1,0")), HasSubstr("line 1: the denominator of x is 0"));
}

TEST(QueryFile, SaysWhatIsWrongAndWhere) {
  const std::string good = query_with("1,1");
  EXPECT_THAT(message_for(good + row("1.5,1")), HasSubstr("file.csv: line 9: '1.5' is no integer"));
  EXPECT_THAT(message_for(good + row("0x1,1")), HasSubstr("line 9"));
  EXPECT_THAT(message_for(good + row(",1")), HasSubstr("'' is no integer"));
  EXPECT_THAT(message_for(good + row(" 1,1")), HasSubstr("line 9"));
  EXPECT_THAT(message_for(good + row("--1,1")), HasSubstr("line 9"));
  EXPECT_THAT(message_for(good + row(std::string(10001, '1') + ",1")), HasSubstr("10000 digits"));
  EXPECT_THAT(message_for(good + "1,1,1,1,1,1\n"), HasSubstr("line 9: 6 fields"));
  EXPECT_THAT(message_for(good + "1,1,1,1,1,1,1,\n"), HasSubstr("line 9: 8 fields"));
  EXPECT_THAT(message_for(good + row("1,1", "2")), HasSubstr("line 9: truth is '2'"));
  EXPECT_THAT(message_for(good + row("1,1", "true")), HasSubstr("line 9: truth"));
  EXPECT_THAT(message_for(good + row("1,1", "0") + row("1,1", "1")), HasSubstr("line 10: truth differs"));
  EXPECT_THAT(message_for(good + row("1,1")), HasSubstr("line 9: the last query has 1 of its 8 rows"));
  EXPECT_THAT(message_for("\n" + good), HasSubstr("line 1: 1 fields"));
  EXPECT_THAT(message_for(""), HasSubstr("no query"));
  EXPECT_EQ(message_for(good + "\n\r\n"), "");
}

TEST(QueryFile, KindsAreToldByThePath) {
  EXPECT_EQ(query_kind_of("a/vertex-face/data.csv"), ContactKind::kVertexFace);
  EXPECT_EQ(query_kind_of("vertex-face/x/edge-edge/data.csv"), ContactKind::kEdgeEdge);
  EXPECT_EQ(query_kind_of("/q/ee.csv"), ContactKind::kEdgeEdge);
  EXPECT_EQ(query_kind_of("vf/1.csv"), ContactKind::kVertexFace);
  EXPECT_FALSE(query_kind_of("data/free.csv"));
  EXPECT_FALSE(query_kind_of(""));
}

TEST(QueryFile, FoldersAreReadWithTheirFolders) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.file("b/edge-edge"));
  std::filesystem::create_directories(folder.file("a/vertex-face"));
  std::filesystem::create_directories(folder.file("empty"));
  for (const char* name : {"b/edge-edge/2.csv", "b/edge-edge/1.csv", "a/vertex-face/1.csv"}) {
    ASSERT_TRUE(write_file(folder.file(name), query_with("1,1")).ok());
  }
  ASSERT_TRUE(write_file(folder.file("a/LICENSE"), "not a query").ok());
  const std::vector<std::string> paths{folder.file(".")};
  const auto read = read_query_files(paths, std::nullopt);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read.value().size(), 3U);
  EXPECT_EQ(read.value()[0].kind, ContactKind::kVertexFace);
  EXPECT_THAT(read.value()[1].path, ::testing::EndsWith("edge-edge/1.csv"));
  const auto overridden = read_query_files(paths, ContactKind::kVertexFace);
  EXPECT_EQ(overridden.value()[2].kind, ContactKind::kVertexFace);
  ASSERT_TRUE(write_file(folder.file("free.csv"), query_with("1,1")).ok());
  const std::vector<std::string> free{folder.file("free.csv")}, empty{folder.file("empty")},
      none{folder.file("none.csv")};
  EXPECT_THAT(read_query_files(free, std::nullopt).error().message, HasSubstr("--type"));
  EXPECT_TRUE(read_query_files(free, ContactKind::kEdgeEdge).ok());
  EXPECT_THAT(read_query_files(empty, std::nullopt).error().message, HasSubstr("no .csv file"));
  EXPECT_THAT(read_query_files(none, ContactKind::kEdgeEdge).error().message, HasSubstr("none.csv"));
}

// Any bytes give an answer or an error, never a crash; and a good file with one damaged byte that still
// parses gives as many queries.
RC_GTEST_PROP(QueryFile, TakesAnyBytes, (const std::string& bytes)) {
  (void)parse_queries(bytes, "file.csv");
}

RC_GTEST_PROP(QueryFile, TakesADamagedFile, ()) {
  std::string text = query_with("-12345678901,4503599627370496") + query_with("1," + power_of_two(1074));
  const auto at = *rc::gen::inRange<std::size_t>(0, text.size());
  text[at] = *rc::gen::element('0', '9', ',', '\n', '-', '+', ' ', '\0', 'e', '.');
  const auto parsed = parse_queries(text, "file.csv");
  if (parsed) RC_ASSERT(parsed.value().size() == 2U);
  if (!parsed) RC_ASSERT(parsed.error().message.starts_with("file.csv: line "));
}

RC_GTEST_PROP(QueryFile, EveryFiniteDoubleSurvives, (std::uint64_t bits)) {
  const double x = std::bit_cast<double>(bits);
  RC_PRE(std::isfinite(x));
  const mpq_class q(x);
  RC_ASSERT(value_of(q.get_num().get_str() + "," + q.get_den().get_str()) == x);
  const mpz_class factor = 6 * (mpz_class(1) << 90);
  RC_ASSERT(value_of(mpz_class(q.get_num() * factor).get_str() + "," +
                     mpz_class(q.get_den() * factor).get_str()) == x);
}

}  // namespace
}  // namespace warmfront::client
