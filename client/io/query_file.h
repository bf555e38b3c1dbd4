// SPDX-License-Identifier: Apache-2.0
// Reads elementary queries with known answers, in the format of the public query sets (Wang et al. 2021, "A
// large-scale benchmark and an inclusion-based algorithm for continuous collision detection"). Pure
// functions; they trust nothing in a file.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/contact.h"
#include "engine/elementary/query.h"
#include "engine/result.h"

namespace warmfront::client {

/// One query, and whether its primitives touch during the step.
struct KnownQuery {
  std::array<VertexMotion, 4>
      vertices;  ///< the vertex and the face's three; or an edge's two and the other's two
  bool truth = false;

  FeatureVertices features(ContactKind kind) const {
    return {kind, {&vertices[0], &vertices[1], &vertices[2], &vertices[3]}};
  }
};

/// A file's queries, all of one kind.
struct QueryFile {
  std::string path;
  ContactKind kind = ContactKind::kVertexFace;
  std::vector<KnownQuery> queries;
};

/// Eight rows a query, `x_num,x_den,y_num,y_den,z_num,z_den,truth`: the four vertices at t = 0, then at t
/// = 1. The coordinates are fractions of decimal integers of any length (up to 10,000 digits) that are
/// exactly doubles, from denormals to the largest; truth is 0 or 1, the same in all eight. Anything else is
/// an error that names the line: a row of another form, a zero denominator, a fraction that is no double, a
/// query cut short, no query at all.
Result<std::vector<KnownQuery>> parse_queries(std::string_view text, std::string_view name);

/// The kind according to the path: the last component named vertex-face or vf, edge-edge or ee.
std::optional<ContactKind> query_kind_of(std::string_view path);

/// Reads files, and all .csv files in folders and their subfolders (in the order of their names). `kind`
/// overrides the paths; without it, a path that has no kind is an error.
Result<std::vector<QueryFile>> read_query_files(std::span<const std::string> paths,
                                                std::optional<ContactKind> kind);

}  // namespace warmfront::client
