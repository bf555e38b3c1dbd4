// SPDX-License-Identifier: Apache-2.0
// Contacts as a series of VTK PolyData files: see contact_writer.h.
#include "client/io/contact_writer.h"
#include "client/io/mesh.h"
#include "client/io/vtp.h"

namespace warmfront::client {
namespace {

std::string format_vtp(std::uint64_t frame, const Positions& start, const Positions& end,
                       std::span<const ContactRecord> contacts, std::span<const ContactGeometry> geometry,
                       const WrittenFields& fields) {
  std::vector<double> points;
  std::vector<double> toi;
  std::vector<std::uint8_t> kind;
  std::vector<std::uint8_t> status;
  std::vector<std::uint32_t> vertices;
  std::vector<std::int64_t> connectivity;
  std::vector<std::int64_t> offsets;
  for (const ContactRecord& contact : contacts) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      const std::size_t count = contact.vertex_count();
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t v = contact.vertices[k];
        const double p0 = coordinate(start, 3 * v + axis);
        sum += p0 + (coordinate(end, 3 * v + axis) - p0) * contact.toi;
      }
      points.push_back(sum / static_cast<double>(count));
    }
    toi.push_back(contact.toi);
    kind.push_back(static_cast<std::uint8_t>(contact.kind));
    status.push_back(static_cast<std::uint8_t>(contact.status));
    vertices.insert(vertices.end(), contact.vertices.begin(), contact.vertices.end());
    connectivity.push_back(static_cast<std::int64_t>(connectivity.size()));
    offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
  }
  const std::vector<std::uint64_t> frames(contacts.size(), frame);

  VtpArrays arrays;
  VtpArrays::Piece piece{.points = contacts.size(), .verts = contacts.size()};
  // One statement each: the order of arrays is that of their bytes.
  piece.content = "<PointData Scalars=\"toi\">\n";
  piece.content += arrays.add<double>("Float64", "toi", 1, toi);
  piece.content += arrays.add<std::uint8_t>("UInt8", "kind", 1, kind);
  piece.content += arrays.add<std::uint8_t>("UInt8", "status", 1, status);
  piece.content += arrays.add<std::uint64_t>("UInt64", "frame", 1, frames);
  piece.content += arrays.add<std::uint32_t>("UInt32", "vertices", 4, vertices);
  const auto add_field = [&](std::string_view name, int components, auto&& of) {
    std::vector<double> values;
    for (const ContactGeometry& one : geometry) {
      const std::span<const double> more = of(one);
      values.insert(values.end(), more.begin(), more.end());
    }
    piece.content += arrays.add<double>("Float64", name, components, values);
  };
  if (fields.weights) add_field("weights", 4, [](const auto& g) { return std::span(g.weights); });
  if (fields.normal) add_field("normal", 3, [](const auto& g) { return std::span(g.normal); });
  if (fields.points) {
    add_field("point_a", 3, [](const auto& g) { return std::span(g.points).template first<3>(); });
    add_field("point_b", 3, [](const auto& g) { return std::span(g.points).template last<3>(); });
  }
  if (fields.direction) add_field("direction", 3, [](const auto& g) { return std::span(g.direction); });
  if (fields.squared_distance)
    add_field("squared_distance", 1, [](const auto& g) { return std::span(&g.squared_distance, 1); });
  if (fields.closest) {
    std::vector<std::uint8_t> closest;
    for (const ContactGeometry& one : geometry) closest.push_back(static_cast<std::uint8_t>(one.closest));
    piece.content += arrays.add<std::uint8_t>("UInt8", "closest", 1, closest);
  }
  if (fields.closest_pair) {
    std::vector<std::uint32_t> multiplicity;
    std::vector<std::uint8_t> stencil;
    for (const ContactRecord& contact : contacts) {
      multiplicity.push_back(contact.closest_pair.multiplicity);
      stencil.push_back(contact.closest_pair.stencil);
    }
    piece.content += arrays.add<std::uint32_t>("UInt32", "multiplicity", 1, multiplicity);
    piece.content += arrays.add<std::uint8_t>("UInt8", "stencil", 1, stencil);
  }
  if (fields.continuity) {
    std::vector<std::uint8_t> continuity;
    for (const ContactRecord& contact : contacts)
      continuity.push_back(static_cast<std::uint8_t>(contact.continuity));
    piece.content += arrays.add<std::uint8_t>("UInt8", "continuity", 1, continuity);
  }
  piece.content += "</PointData>\n<Points>\n";
  piece.content += arrays.add<double>("Float64", "Points", 3, points);
  piece.content += "</Points>\n<Verts>\n";
  piece.content += arrays.add<std::int64_t>("Int64", "connectivity", 1, connectivity);
  piece.content += arrays.add<std::int64_t>("Int64", "offsets", 1, offsets);
  piece.content += "</Verts>\n";
  return arrays.format(piece);
}

class VtpContactWriter final : public ContactWriter {
 public:
  VtpContactWriter(VtpSeries series, const WrittenFields& fields)
      : series_(std::move(series)), fields_(fields) {}

  Status write(std::uint64_t frame, const Positions& start, const Positions& end,
               std::span<const ContactRecord> contacts, std::span<const ContactGeometry> geometry) override {
    return series_.add(frame, format_vtp(frame, start, end, contacts, geometry, fields_));
  }

  Status close() override { return series_.close(); }

 private:
  VtpSeries series_;
  WrittenFields fields_;
};

}  // namespace

Result<std::unique_ptr<ContactWriter>> open_vtp_contact_writer(const std::string& path,
                                                               const WrittenFields& fields) {
  Result<VtpSeries> series = VtpSeries::create(path);
  if (!series) return series.error();
  return std::unique_ptr<ContactWriter>(
      std::make_unique<VtpContactWriter>(std::move(series).value(), fields));
}

}  // namespace warmfront::client
