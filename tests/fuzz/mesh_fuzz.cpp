// SPDX-License-Identifier: Apache-2.0
// Any bytes as PLY, OBJ and STL: refused with a place, or a mesh whose faces are within its vertices and
// which comes back with the same bits when it is written as PLY and read again. One thread.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "client/io/obj.h"
#include "client/io/ply.h"
#include "client/io/stl.h"
#include "client/io/triangulate.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace warmfront;
using namespace warmfront::client;
using fuzz::expect;

/// A number that is none may lose its payload on the way; all others keep every bit.
template <class T>
bool same(T a, T b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0 || (std::isnan(a) && std::isnan(b));
}

bool same_bits(const PositionBuffer& a, const PositionBuffer& b) {
  if (a.index() != b.index()) return false;
  return std::visit(
      [&](const auto& x) {
        const auto& y = std::get<std::decay_t<decltype(x)>>(b);
        return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](auto p, auto q) { return same(p, q); });
      },
      a);
}

void check(const Result<Mesh>& parsed) {
  if (!parsed) {
    expect(parsed.error().message.starts_with("fuzz:"), "an error names the file");
    return;
  }
  const Mesh& mesh = parsed.value();
  const auto vertices = static_cast<std::int64_t>(vertex_count(mesh.positions));
  for (const auto& face : mesh.faces)
    for (const std::int32_t v : face) expect(v >= 0 && v < vertices, "a face's vertices exist");
  for (const auto& [a, b] : mesh.edges)
    expect(a >= 0 && a < vertices && b >= 0 && b < vertices && a != b,
           "an edge's vertices exist, and are two");
  const Result<Mesh> again = parse_ply(format_ply(mesh, "fuzz"), "fuzz");
  expect(again.ok(), "what is written as PLY can be read");
  expect(same_bits(again.value().positions, mesh.positions) && again.value().faces == mesh.faces &&
             again.value().edges == mesh.edges,
         "and is the same mesh");
  Mesh cut = mesh;
  if (const Status status = triangulate(cut, "fuzz"); !status) {
    expect(status.error().message.starts_with("fuzz:"), "an error names the file");
    return;
  }
  expect(cut.faces.size() == mesh.faces.size(), "a polygon has as many triangles as its fan");
  for (const auto& face : cut.faces)
    for (const std::int32_t v : face) expect(v >= 0 && v < vertices, "and of vertices that exist");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  check(parse_ply(bytes, "fuzz"));
  check(parse_obj(bytes, "fuzz"));
  check(parse_stl(bytes, "fuzz"));
  return 0;
}
