// SPDX-License-Identifier: Apache-2.0
// STL: see stl.h.
#include "client/io/stl.h"

#include <array>
#include <bit>
#include <optional>
#include <string>
#include <unordered_map>

#include "client/io/endian.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

constexpr std::size_t kHeaderBytes = 84;  // 80 of text, then the count
constexpr std::size_t kFacetBytes = 50;   // normal, three corners, 16 bits of attributes

/// Numbers corners by the bits of their coordinates, in order of first appearance.
template <class T>
class Welder {
 public:
  using Point = std::array<T, 3>;

  void add(const std::array<Point, 3>& corners) {
    std::array<std::int32_t, 3> face;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [found, fresh] =
          index_.try_emplace(corners[k], static_cast<std::int32_t>(positions_.size() / 3));
      if (fresh) positions_.insert(positions_.end(), corners[k].begin(), corners[k].end());
      face[k] = found->second;
    }
    faces_.push_back(face);
  }

  Mesh take() { return {std::move(positions_), std::move(faces_)}; }

 private:
  using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  struct Hash {
    std::size_t operator()(const Point& p) const {
      std::uint64_t h = 0xcbf29ce484222325ULL;
      for (const T x : p) {
        h ^= std::bit_cast<Bits>(x);
        h *= 0x9e3779b97f4a7c15ULL;
        h ^= h >> 32;
      }
      return static_cast<std::size_t>(h);
    }
  };
  struct SameBits {
    bool operator()(const Point& p, const Point& q) const {
      for (std::size_t k = 0; k < 3; ++k)
        if (std::bit_cast<Bits>(p[k]) != std::bit_cast<Bits>(q[k])) return false;
      return true;
    }
  };

  std::unordered_map<Point, std::int32_t, Hash, SameBits> index_;
  std::vector<T> positions_;
  std::vector<std::array<std::int32_t, 3>> faces_;
};

Mesh parse_binary(std::string_view bytes, std::uint32_t count) {
  Welder<float> welder;
  for (std::uint32_t facet = 0; facet < count; ++facet) {
    const std::size_t offset = kHeaderBytes + kFacetBytes * facet;
    const char* at = bytes.data() + offset + 12;
    std::array<std::array<float, 3>, 3> corners;
    for (auto& corner : corners)
      for (float& x : corner) {
        x = load_scalar<float>(at, std::endian::little);
        at += sizeof(float);
      }
    welder.add(corners);
  }
  return welder.take();
}

class AsciiParser {
 public:
  AsciiParser(std::string_view bytes, std::string_view file) : lines_(bytes), file_(file) {}

  Result<Mesh> run() {
    std::string_view line;
    while (lines_.next(line)) {
      const std::string_view keyword = next_word(line);
      if (keyword.empty()) continue;
      if (std::optional<std::string> problem = take(keyword, line))
        return error_at_line(file_, lines_.line_number(), *problem);
    }
    if (state_ != State::kOutside)
      return error_at_line(file_, lines_.line_number(), "the file ends within a solid");
    return welder_.take();
  }

 private:
  enum class State { kOutside, kSolid, kFacet, kLoop, kLoopDone };

  std::optional<std::string> take(std::string_view keyword, std::string_view rest) {
    if (keyword == "solid") return expect(State::kOutside, State::kSolid, keyword);
    if (keyword == "facet") return expect(State::kSolid, State::kFacet, keyword);
    if (keyword == "outer") {
      corner_ = 0;
      return expect(State::kFacet, State::kLoop, keyword);
    }
    if (keyword == "vertex") return vertex(rest);
    if (keyword == "endloop") {
      if (corner_ != 3) return "a loop has three vertices, this one has " + std::to_string(corner_);
      return expect(State::kLoop, State::kLoopDone, keyword);
    }
    if (keyword == "endfacet") {
      if (auto problem = expect(State::kLoopDone, State::kSolid, keyword)) return problem;
      welder_.add(corners_);
      return std::nullopt;
    }
    if (keyword == "endsolid") return expect(State::kSolid, State::kOutside, keyword);
    return "unknown keyword " + in_quotes(keyword);
  }

  std::optional<std::string> expect(State from, State to, std::string_view keyword) {
    if (state_ != from) return in_quotes(keyword) + " is out of place";
    state_ = to;
    return std::nullopt;
  }

  std::optional<std::string> vertex(std::string_view rest) {
    if (state_ != State::kLoop) return "'vertex' is out of place";
    if (corner_ == 3) return "a fourth vertex in a loop";
    for (double& x : corners_[corner_]) {
      const std::string_view word = next_word(rest);
      if (word.empty()) return "a vertex needs three coordinates";
      if (!parse_number(word, x)) return "coordinate " + in_quotes(word) + " is no number";
    }
    ++corner_;
    return std::nullopt;
  }

  LineScanner lines_;
  std::string_view file_;
  State state_ = State::kOutside;
  std::array<std::array<double, 3>, 3> corners_{};
  std::size_t corner_ = 0;
  Welder<double> welder_;
};

}  // namespace

Result<Mesh> parse_stl(std::string_view bytes, std::string_view file) {
  const bool has_header = bytes.size() >= kHeaderBytes;
  const std::uint32_t count =
      has_header ? load_scalar<std::uint32_t>(bytes.data() + 80, std::endian::little) : 0;
  const std::uint64_t expected = kHeaderBytes + std::uint64_t{kFacetBytes} * count;
  // Some binary files start with "solid" too, so check the size first.
  if (has_header && bytes.size() == expected) return parse_binary(bytes, count);
  std::string_view probe = bytes.substr(0, kHeaderBytes);
  if (next_word(probe).substr(0, 5) == "solid") return AsciiParser(bytes, file).run();
  if (!has_header)
    return error_at_byte(file, bytes.size(), "not an STL file: too short, and no 'solid' at its start");
  if (bytes.size() < expected)
    return error_at_byte(file, bytes.size(),
                         "the file ends here, but its " + std::to_string(count) + " facets need " +
                             std::to_string(expected) + " bytes");
  return parse_binary(bytes, count);
}

}  // namespace warmfront::client
