// SPDX-License-Identifier: Apache-2.0
// Changes of the scene from messages: see scene_change.h.
#include "proto/wire/scene_change.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/wire/filters.h"
#include "proto/wire/scene.h"

namespace warmfront::wire {
namespace {

Error bad_bytes(const std::string& where, std::size_t bytes, const std::string& expected) {
  return invalid_argument(where + ": " + std::to_string(bytes) + " bytes, but " + expected);
}

template <class T>
std::vector<T> values_of(std::string_view bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

// As many as there are bytes for, of `what`.
template <class T>
Result<std::vector<T>> all_of(std::string_view bytes, const std::string& where, const char* what) {
  if (bytes.size() % sizeof(T) != 0)
    return bad_bytes(
        where, bytes.size(),
        std::to_string(bytes.size() / sizeof(T) * sizeof(T)) + " are expected for a whole number of " + what);
  return values_of<T>(bytes);
}

Result<std::vector<double>> positions_from(std::string_view bytes, std::uint64_t vertices, bool float32,
                                           const std::string& where) {
  const std::uint64_t expected = 3 * vertices * (float32 ? sizeof(float) : sizeof(double));
  if (bytes.size() != expected)
    return bad_bytes(where, bytes.size(),
                     std::to_string(expected) + " bytes are expected (" + std::to_string(vertices) +
                         " vertices x 3 x " + (float32 ? "float32)" : "float64)"));
  if (!float32) return values_of<double>(bytes);
  const std::vector<float> values = values_of<float>(bytes);
  return std::vector<double>(values.begin(), values.end());
}

using Faces = std::vector<std::array<std::int32_t, 3>>;
using Edges = std::vector<std::array<std::int32_t, 2>>;

Result<AddBody> addition_from(const v1::BodyAddition& message, bool float32, const std::string& where) {
  Result<Body> body = body_from(message.body(), where + ".body");
  if (!body) return body.error();
  Result<Faces> faces = all_of<Faces::value_type>(message.faces(), where + ".faces", "faces");
  if (!faces) return faces.error();
  Result<Edges> edges = all_of<Edges::value_type>(message.edges(), where + ".edges", "edges");
  if (!edges) return edges.error();
  Result<std::vector<double>> thickness =
      all_of<double>(message.thickness(), where + ".thickness", "float64");
  if (!thickness) return thickness.error();
  Result<std::vector<double>> positions =
      positions_from(message.positions(), body.value().vertex_count, float32, where + ".positions");
  if (!positions) return positions.error();
  return AddBody{{std::move(body).value(), std::move(faces).value(), std::move(edges).value(),
                  std::move(thickness).value()},
                 std::move(positions).value()};
}

}  // namespace

Result<SceneChange> change_from(const v1::SceneChange& message, bool float32, const std::string& where) {
  switch (message.what_case()) {
    case v1::SceneChange::kAdd: {
      Result<AddBody> add = addition_from(message.add(), float32, where + ".add");
      if (!add) return add.error();
      return SceneChange(std::move(add).value());
    }
    case v1::SceneChange::kChange: {
      if (!message.change().has_body())
        return invalid_argument(where + ".change.body: is missing; give all of the body's description");
      Result<Body> body = body_from(message.change().body(), where + ".change.body");
      if (!body) return body.error();
      return SceneChange(ChangeBody{message.change().index(), std::move(body).value()});
    }
    case v1::SceneChange::kChangeFilters: {
      Result<PairFilters> filters = filters_from(message.change_filters(), where + ".change_filters");
      if (!filters) return filters.error();
      return SceneChange(ChangeFilters{std::move(filters).value()});
    }
    case v1::SceneChange::kChangeExcludedPairs:
      return SceneChange(ChangeExcludedPairs{body_pairs_from(message.change_excluded_pairs().pairs())});
    case v1::SceneChange::kReplaceElements: {
      const v1::ElementsReplacement& replacement = message.replace_elements();
      const std::string in = where + ".replace_elements";
      Result<Faces> faces = all_of<Faces::value_type>(replacement.faces(), in + ".faces", "faces");
      if (!faces) return faces.error();
      Result<Edges> edges = all_of<Edges::value_type>(replacement.edges(), in + ".edges", "edges");
      if (!edges) return edges.error();
      return SceneChange(
          ReplaceElements{replacement.index(), std::move(faces).value(), std::move(edges).value()});
    }
    case v1::SceneChange::kReplaceBody: {
      Result<AddBody> with =
          addition_from(message.replace_body().with(), float32, where + ".replace_body.with");
      if (!with) return with.error();
      return SceneChange(ReplaceBody{message.replace_body().index(), std::move(with.value().addition),
                                     std::move(with.value().positions)});
    }
    case v1::SceneChange::WHAT_NOT_SET:
      break;
  }
  return invalid_argument(where +
                          ": carries none of add, change, change_filters, change_excluded_pairs, "
                          "replace_elements and replace_body");
}

}  // namespace warmfront::wire
