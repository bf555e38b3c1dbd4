// SPDX-License-Identifier: Apache-2.0
// Mesh files by extension: see mesh_file.h.
#include "client/io/mesh_file.h"

#include <algorithm>

#include "client/io/file.h"
#include "client/io/obj.h"
#include "client/io/ply.h"
#include "client/io/stl.h"
#include "client/io/text.h"
#include "client/io/triangulate.h"

namespace warmfront::client {
namespace {

using Parser = Result<Mesh> (*)(std::string_view, std::string_view);

Parser parser_for(std::string_view path) {
  if (has_ending(path, ".ply")) return parse_ply;
  if (has_ending(path, ".obj")) return parse_obj;
  if (has_ending(path, ".stl")) return parse_stl;
  return nullptr;
}

}  // namespace

bool is_mesh_file_name(std::string_view path) {
  return parser_for(path) != nullptr;
}

Result<Mesh> read_listed_mesh(const std::string& path) {
  const Parser parse = parser_for(path);
  if (!parse) return invalid_argument(path + ": not a mesh file by its name: .ply, .obj and .stl are read");
  const Result<std::string> bytes = read_file(path);
  if (!bytes) return bytes.error();
  Result<Mesh> mesh = parse(bytes.value(), path);
  // A failed export, or not a mesh: without this error the answer would be "no contact".
  if (mesh && vertex_count(mesh.value().positions) == 0)
    return invalid_argument(path + ": no vertex is in it; a mesh with one or more is expected");
  return mesh;
}

Status make_scene_mesh(Mesh& mesh, const std::string& path) {
  return triangulate(mesh, path);
}

Result<Mesh> read_mesh(const std::string& path) {
  Result<Mesh> mesh = read_listed_mesh(path);
  if (!mesh) return mesh;
  if (const Status status = make_scene_mesh(mesh.value(), path); !status) return status.error();
  return mesh;
}

std::vector<std::string> notes_on(const Mesh& mesh, const std::string& path) {
  std::vector<std::string> notes;
  std::vector<bool> named(vertex_count(mesh.positions));
  const auto name_all = [&](const auto& elements) {
    for (const auto& element : elements)
      for (const std::int32_t v : element) named[static_cast<std::size_t>(v)] = true;
  };
  name_all(mesh.faces);
  name_all(mesh.edges);
  if (const auto alone = std::ranges::count(named, false); alone > 0)
    notes.push_back(
        path + ": vertices in no face and no edge: " + std::to_string(alone) + " of " +
        std::to_string(named.size()) +
        "; as points they meet faces, and with a separation or thickness edges of no face and each "
        "other");
  return notes;
}

}  // namespace warmfront::client
