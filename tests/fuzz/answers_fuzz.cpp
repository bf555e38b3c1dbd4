// SPDX-License-Identifier: Apache-2.0
// Any bytes as a file of queries with known answers, and as a file of known pairs: refused with a line, or
// read into values that keep the formats' promises. One thread.
#include <algorithm>
#include <cmath>

#include "client/io/query_file.h"
#include "client/io/truth_file.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace warmfront;
using namespace warmfront::client;
using fuzz::expect;

bool names_a_line(const Error& error) {
  return error.message.starts_with("fuzz: line ");
}

void check_queries(std::string_view text) {
  const auto queries = parse_queries(text, "fuzz");
  if (!queries) return expect(names_a_line(queries.error()), "a bad query file names the line");
  expect(!queries.value().empty(), "a query file has a query");
  for (const KnownQuery& query : queries.value())
    for (const VertexMotion& vertex : query.vertices)
      for (std::size_t axis = 0; axis < 3; ++axis)
        expect(std::isfinite(vertex.t0[axis]) && std::isfinite(vertex.t1[axis]), "coordinates are doubles");
}

void check_pairs(std::string_view text) {
  constexpr std::uint32_t kVertices = 1000;
  const auto pairs = parse_known_pairs(text, "fuzz", kVertices);
  if (!pairs) return expect(names_a_line(pairs.error()), "a bad file of pairs names the line");
  for (const auto* list : {&pairs.value().touching, &pairs.value().apart}) {
    expect(std::ranges::is_sorted(*list), "pairs are sorted");
    expect(std::ranges::adjacent_find(*list) == list->end(), "each pair once");
    for (const PairKey& pair : *list)
      for (const std::uint32_t v : pair.vertices) expect(v < kVertices, "a pair's vertices exist");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check_queries(text);
  check_pairs(text);
  return 0;
}
