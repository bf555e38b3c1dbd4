// SPDX-License-Identifier: Apache-2.0
// Known answers: see truth_file.h.
#include "client/io/truth_file.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "client/io/text.h"

namespace warmfront::client {
namespace {

std::string_view next_field(std::string_view& rest) {
  const std::size_t comma = rest.find(',');
  const std::string_view field = rest.substr(0, comma);
  rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  return field;
}

void sort_and_unite(std::vector<PairKey>& pairs) {
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

}  // namespace

PairKey PairKey::of(ContactKind kind, std::array<std::uint32_t, 4> v) {
  if (kind == ContactKind::kVertexFace) {
    std::sort(v.begin() + 1, v.end());
    return {kind, v};
  }
  if (v[1] < v[0]) std::swap(v[0], v[1]);
  if (v[3] < v[2]) std::swap(v[2], v[3]);
  if (std::pair(v[2], v[3]) < std::pair(v[0], v[1])) {
    std::swap(v[0], v[2]);
    std::swap(v[1], v[3]);
  }
  return {kind, v};
}

Result<KnownPairs> parse_known_pairs(std::string_view text, std::string_view name,
                                     std::uint32_t vertex_count) {
  constexpr std::string_view kHeader = "type,v0,v1,v2,v3,collides";
  LineScanner lines(text);
  std::string_view line;
  if (!lines.next(line) || line != kHeader)
    return error_at_line(name, 1, "the header is not " + std::string(kHeader));
  KnownPairs pairs;
  while (lines.next(line)) {
    std::string_view rest = line;
    const std::string_view type = next_field(rest);
    if (type != "vf" && type != "ee")
      return error_at_line(name, lines.line_number(), in_quotes(type) + " is neither vf nor ee");
    std::array<std::uint32_t, 4> vertices{};
    for (std::uint32_t& vertex : vertices) {
      const std::string_view word = next_field(rest);
      std::uint64_t id = 0;
      if (!parse_number(word, id) || id >= vertex_count)
        return error_at_line(
            name, lines.line_number(),
            in_quotes(word) + " is no vertex of the scene's " + std::to_string(vertex_count));
      vertex = static_cast<std::uint32_t>(id);
    }
    if (rest != "0" && rest != "1")
      return error_at_line(name, lines.line_number(), "collides is " + in_quotes(rest) + ", neither 0 nor 1");
    const auto kind = type == "vf" ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
    (rest == "1" ? pairs.touching : pairs.apart).push_back(PairKey::of(kind, vertices));
  }
  sort_and_unite(pairs.touching);
  sort_and_unite(pairs.apart);
  std::vector<PairKey> both;
  std::ranges::set_intersection(pairs.touching, pairs.apart, std::back_inserter(both));
  if (!both.empty())
    return error_at_line(name, lines.line_number(), std::to_string(both.size()) + " pairs have both answers");
  return pairs;
}

}  // namespace warmfront::client
