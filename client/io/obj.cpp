// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: see obj.h.
#include "client/io/obj.h"

#include <limits>
#include <optional>
#include <string>

#include "client/io/text.h"

namespace warmfront::client {
namespace {

using Problem = std::optional<std::string>;

class ObjParser {
 public:
  ObjParser(std::string_view bytes, std::string_view file) : lines_(bytes), file_(file) {}

  Result<Mesh> run() {
    std::string joined;
    std::string_view line;
    while (lines_.next(line)) {
      // Copied only if the line is continued, which is rare.
      if (!line.empty() && line.back() == '\\') {
        joined.clear();
        bool more = true;
        while (more) {
          more = !line.empty() && line.back() == '\\';
          joined.append(more ? line.substr(0, line.size() - 1) : line).push_back(' ');
          more = more && lines_.next(line);
        }
        line = joined;
      }
      const std::string_view keyword = next_word(line);
      Problem problem;
      if (keyword == "v") problem = vertex(line);
      if (keyword == "f") problem = face(line);
      if (keyword == "l") problem = line_strip(line);
      if (problem) return error_at_line(file_, lines_.line_number(), *problem);
    }
    // Faces may precede their vertices, so indices are checked at the end.
    const std::size_t count = positions_.size() / 3;
    if (largest_index_ > count)
      return error_at_line(file_, largest_index_line_,
                           "vertex index " + std::to_string(largest_index_) + ", but the file has " +
                               std::to_string(count) + " vertices");
    mesh_.positions = std::move(positions_);
    return std::move(mesh_);
  }

 private:
  Problem vertex(std::string_view rest) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = next_word(rest);
      double value = 0;
      if (word.empty()) return "a vertex needs three coordinates";
      if (!parse_number(word, value)) return "coordinate " + in_quotes(word) + " is no number";
      positions_.push_back(value);
    }
    return std::nullopt;
  }

  Problem face(std::string_view rest) {
    if (Problem problem = corners(rest, "face corner")) return problem;
    if (corners_.size() < 3)
      return "a face needs three vertices, this one has " + std::to_string(corners_.size());
    append_face(corners_, lines_.line_number(), faces_++, mesh_);
    return std::nullopt;
  }

  Problem line_strip(std::string_view rest) {
    if (Problem problem = corners(rest, "line vertex")) return problem;
    if (corners_.size() < 2)
      return "a line needs two vertices, this one has " + std::to_string(corners_.size());
    for (std::size_t i = 1; i < corners_.size(); ++i) {
      if (corners_[i] == corners_[i - 1])
        return "the line joins vertex " + std::to_string(corners_[i] + 1) + " to itself";
      mesh_.edges.push_back({corners_[i - 1], corners_[i]});
    }
    return std::nullopt;
  }

  // Reads the indices of a line, `what` each, from 0.
  Problem corners(std::string_view rest, const std::string& what) {
    const auto count = static_cast<std::int64_t>(positions_.size() / 3);
    corners_.clear();
    for (std::string_view word = next_word(rest); !word.empty() && word[0] != '#'; word = next_word(rest)) {
      std::int64_t index = 0;
      if (!parse_number(word.substr(0, word.find('/')), index))
        return what + " " + in_quotes(word) + " is no index";
      if (index == 0) return "vertex index 0: indices start at 1";
      if (index < 0) {
        if (-(index + 1) >= count)
          return "vertex index " + std::to_string(index) + " counts back beyond the first vertex";
        index += count + 1;
      }
      if (index > std::numeric_limits<std::int32_t>::max())
        return "vertex index " + std::to_string(index) + " is too large";
      if (static_cast<std::size_t>(index) > largest_index_) {
        largest_index_ = static_cast<std::size_t>(index);
        largest_index_line_ = lines_.line_number();
      }
      corners_.push_back(static_cast<std::int32_t>(index - 1));
    }
    return std::nullopt;
  }

  LineScanner lines_;
  std::string_view file_;
  std::vector<double> positions_;
  Mesh mesh_;
  std::size_t faces_ = 0;  // in the file
  std::vector<std::int32_t> corners_;
  std::size_t largest_index_ = 0;
  std::size_t largest_index_line_ = 0;
};

}  // namespace

Result<Mesh> parse_obj(std::string_view bytes, std::string_view file) {
  return ObjParser(bytes, file).run();
}

}  // namespace warmfront::client
