// SPDX-License-Identifier: Apache-2.0
// Mesh files by extension: see mesh_file.h.
#include "client/io/mesh_file.h"

#include "client/io/file.h"
#include "client/io/obj.h"
#include "client/io/ply.h"
#include "client/io/stl.h"

namespace warmfront::client {
namespace {

using Parser = Result<Mesh> (*)(std::string_view, std::string_view);

Parser parser_for(std::string_view path) {
  if (path.size() < 4) return nullptr;
  std::string extension(path.substr(path.size() - 4));
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  if (extension == ".ply") return parse_ply;
  if (extension == ".obj") return parse_obj;
  if (extension == ".stl") return parse_stl;
  return nullptr;
}

}  // namespace

bool is_mesh_file_name(std::string_view path) {
  return parser_for(path) != nullptr;
}

Result<Mesh> read_mesh(const std::string& path) {
  const Parser parse = parser_for(path);
  if (!parse) return invalid_argument(path + ": not a mesh file by its name: .ply, .obj and .stl are read");
  const Result<std::string> bytes = read_file(path);
  if (!bytes) return bytes.error();
  Result<Mesh> mesh = parse(bytes.value(), path);
  // An exporter that failed, or something else by this name: its answer would be that nothing touches.
  if (mesh && vertex_count(mesh.value().positions) == 0)
    return invalid_argument(path + ": no vertex is in it; a mesh with one or more is expected");
  return mesh;
}

}  // namespace warmfront::client
