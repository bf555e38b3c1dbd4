// SPDX-License-Identifier: Apache-2.0
// Known answers: pairs in canonical order, for any order in the file; everything else is refused with its
// line.
#include "client/io/truth_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kHeader = "type,v0,v1,v2,v3,collides\n";

std::string message_of_truth(const std::string& text) {
  const auto parsed = parse_known_pairs(text, "truth.csv", 100);
  return parsed ? "" : parsed.error().message;
}

TEST(TruthFile, PairsHaveOneOrder) {
  const auto parsed = parse_known_pairs(
      kHeader + "vf,9,3,1,2,1\nvf,9,2,3,1,1\nee,7,6,5,4,1\nee,4,5,6,7,1\nvf,1,2,3,4,0\r\n", "truth.csv", 100);
  ASSERT_TRUE(parsed.ok()) << parsed.error().message;
  EXPECT_THAT(parsed.value().touching, ElementsAre(PairKey{ContactKind::kVertexFace, {9, 1, 2, 3}},
                                                   PairKey{ContactKind::kEdgeEdge, {4, 5, 6, 7}}));
  EXPECT_THAT(parsed.value().apart, ElementsAre(PairKey{ContactKind::kVertexFace, {1, 2, 3, 4}}));
}

TEST(TruthFile, SaysWhatIsWrongAndWhere) {
  EXPECT_THAT(message_of_truth(""), HasSubstr("truth.csv: line 1: the header"));
  EXPECT_THAT(message_of_truth("vf,1,2,3,4,1\n"), HasSubstr("line 1: the header"));
  EXPECT_THAT(message_of_truth(kHeader + "fv,1,2,3,4,1\n"), HasSubstr("line 2: 'fv' is neither"));
  EXPECT_THAT(message_of_truth(kHeader + "vf,1,2,3,100,1\n"), HasSubstr("line 2: '100' is no vertex"));
  EXPECT_THAT(message_of_truth(kHeader + "vf,1,2,-3,4,1\n"), HasSubstr("line 2: '-3'"));
  EXPECT_THAT(message_of_truth(kHeader + "vf,1,2,3,4,yes\n"), HasSubstr("line 2: collides is 'yes'"));
  EXPECT_THAT(message_of_truth(kHeader + "vf,1,2,3,4\n"), HasSubstr("line 2"));
  EXPECT_THAT(message_of_truth(kHeader + "vf,1,2,3,4,1,1\n"), HasSubstr("line 2"));
  EXPECT_THAT(message_of_truth(kHeader + "vf,1,2,3,4,1\n\n"), HasSubstr("line 3"));
  EXPECT_THAT(message_of_truth(kHeader + "vf,1,2,3,4,1\nvf,1,4,3,2,0\n"),
              HasSubstr("1 pairs have both answers"));
  EXPECT_EQ(message_of_truth(kHeader), "");
}

RC_GTEST_PROP(TruthFile, TakesAnyBytes, (const std::string& bytes)) {
  (void)parse_known_pairs(bytes, "truth.csv", 100);
  (void)parse_known_pairs(kHeader + bytes, "truth.csv", 100);
}

}  // namespace
}  // namespace warmfront::client
