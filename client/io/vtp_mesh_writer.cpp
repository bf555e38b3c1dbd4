// SPDX-License-Identifier: Apache-2.0
// Meshes for ParaView: see vtp_mesh_writer.h.
#include "client/io/vtp_mesh_writer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "client/io/mesh.h"

namespace warmfront::client {

void VtpMeshWriter::take_scene(const SceneDescription& scene) {
  lines_ = {};
  triangles_ = {};
  bodies_.clear();
  const auto add = [&](const auto& cell, Cells& to) {
    to.corners.insert(to.corners.end(), cell.begin(), cell.end());
    to.ends.push_back(static_cast<std::int64_t>(to.corners.size()));
    // It lies within one body, and bodies are ranges in order.
    std::uint32_t body = 0;
    const auto after =
        std::ranges::upper_bound(scene.bodies, static_cast<std::uint32_t>(cell[0]), {}, &Body::first_vertex);
    if (after != scene.bodies.begin()) body = static_cast<std::uint32_t>(after - scene.bodies.begin() - 1);
    bodies_.push_back(body);
  };
  for (const auto& edge : scene.edges) add(edge, lines_);
  for (const auto& face : scene.faces) add(face, triangles_);
}

std::string VtpMeshWriter::Cells::format(VtpArrays& arrays, const std::string& kind) const {
  // One statement each: the order of arrays is that of their bytes.
  std::string content = "<" + kind + ">\n";
  content += arrays.add<std::int64_t>("Int64", "connectivity", 1, corners);
  content += arrays.add<std::int64_t>("Int64", "offsets", 1, ends);
  return content + "</" + kind + ">\n";
}

Result<VtpMeshWriter> VtpMeshWriter::create(const std::string& path, const SceneDescription& scene) {
  Result<VtpSeries> series = VtpSeries::create(path);
  if (!series) return series.error();
  VtpMeshWriter writer(std::move(series).value());
  writer.take_scene(scene);
  return writer;
}

Status VtpMeshWriter::write(std::uint64_t number, const Positions& positions,
                            std::span<const ContactRecord> contacts) {
  const std::size_t numbers = std::visit([](auto values) { return values.size(); }, positions);
  std::vector<double> toi(numbers / 3, std::numeric_limits<double>::quiet_NaN());
  for (const ContactRecord& contact : contacts) {
    for (std::size_t k = 0; k < contact.vertex_count(); ++k) {
      double& first = toi[contact.vertices[k]];
      first = std::fmin(first, contact.toi);
    }
  }

  VtpArrays arrays;
  VtpArrays::Piece piece{.points = toi.size(), .lines = lines_.ends.size(), .polys = triangles_.ends.size()};
  piece.content = "<PointData Scalars=\"toi\">\n";
  piece.content += arrays.add<double>("Float64", "toi", 1, toi);
  piece.content += "</PointData>\n<CellData>\n";
  piece.content += arrays.add<std::uint32_t>("UInt32", "body", 1, bodies_);
  piece.content += "</CellData>\n<Points>\n";
  if (const auto* narrow = std::get_if<std::span<const float>>(&positions))
    piece.content += arrays.add<float>("Float32", "Points", 3, *narrow);
  else
    piece.content += arrays.add<double>("Float64", "Points", 3, std::get<std::span<const double>>(positions));
  piece.content += "</Points>\n";
  if (!lines_.ends.empty()) piece.content += lines_.format(arrays, "Lines");
  piece.content += triangles_.format(arrays, "Polys");
  return series_.add(number, arrays.format(piece));
}

}  // namespace warmfront::client
