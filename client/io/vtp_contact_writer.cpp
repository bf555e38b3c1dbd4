// SPDX-License-Identifier: Apache-2.0
// Contacts as a series of VTK PolyData files: see contact_writer.h. The arrays are appended raw, as ParaView
// itself writes them: each is preceded by its size in bytes (uint64), and offsets count from the mark "_".
#include "client/io/contact_writer.h"
#include "client/io/endian.h"
#include "client/io/file.h"
#include "client/io/mesh.h"

namespace warmfront::client {
namespace {

/// Collects arrays: their descriptions for the XML, and their bytes for its appended section.
class AppendedArrays {
 public:
  template <class T>
  std::string add(std::string_view type, std::string_view name, int components, std::span<const T> values) {
    std::string xml = "<DataArray type=\"" + std::string(type) + "\" Name=\"" + std::string(name) +
                      "\" NumberOfComponents=\"" + std::to_string(components) +
                      "\" format=\"appended\" offset=\"" + std::to_string(bytes_.size()) + "\"/>\n";
    append_little(bytes_, static_cast<std::uint64_t>(values.size_bytes()));
    for (const T value : values) append_little(bytes_, value);
    return xml;
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string format_vtp(std::uint64_t frame, const Positions& start, const Positions& end,
                       std::span<const ContactRecord> contacts, std::span<const ContactGeometry> geometry,
                       const ContactFields& fields) {
  std::vector<double> points;
  std::vector<double> toi;
  std::vector<std::uint8_t> kind;
  std::vector<std::uint8_t> status;
  std::vector<std::int64_t> connectivity;
  std::vector<std::int64_t> offsets;
  for (const ContactRecord& contact : contacts) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (const std::size_t v : contact.vertices) {
        const double p0 = coordinate(start, 3 * v + axis);
        sum += p0 + (coordinate(end, 3 * v + axis) - p0) * contact.toi;
      }
      points.push_back(sum / 4);
    }
    toi.push_back(contact.toi);
    kind.push_back(static_cast<std::uint8_t>(contact.kind));
    status.push_back(static_cast<std::uint8_t>(contact.status));
    connectivity.push_back(static_cast<std::int64_t>(connectivity.size()));
    offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
  }
  const std::vector<std::uint64_t> frames(contacts.size(), frame);
  const std::string count = std::to_string(contacts.size());

  AppendedArrays arrays;
  std::string xml =
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<PolyData>\n"
      "<Piece NumberOfPoints=\"" +
      count + "\" NumberOfVerts=\"" + count +
      "\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n<PointData Scalars=\"toi\">\n";
  xml += arrays.add<double>("Float64", "toi", 1, toi);
  xml += arrays.add<std::uint8_t>("UInt8", "kind", 1, kind);
  xml += arrays.add<std::uint8_t>("UInt8", "status", 1, status);
  xml += arrays.add<std::uint64_t>("UInt64", "frame", 1, frames);
  const auto add_field = [&](std::string_view name, int components, auto&& of) {
    std::vector<double> values;
    for (const ContactGeometry& one : geometry) {
      const std::span<const double> more = of(one);
      values.insert(values.end(), more.begin(), more.end());
    }
    xml += arrays.add<double>("Float64", name, components, values);
  };
  if (fields.weights) add_field("weights", 4, [](const auto& g) { return std::span(g.weights); });
  if (fields.normal) add_field("normal", 3, [](const auto& g) { return std::span(g.normal); });
  if (fields.points) {
    add_field("point_a", 3, [](const auto& g) { return std::span(g.points).template first<3>(); });
    add_field("point_b", 3, [](const auto& g) { return std::span(g.points).template last<3>(); });
  }
  xml += "</PointData>\n<Points>\n" + arrays.add<double>("Float64", "Points", 3, points) +
         "</Points>\n<Verts>\n";
  xml += arrays.add<std::int64_t>("Int64", "connectivity", 1, connectivity);
  xml += arrays.add<std::int64_t>("Int64", "offsets", 1, offsets);
  xml += "</Verts>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_";
  return xml + arrays.bytes() + "\n</AppendedData>\n</VTKFile>\n";
}

/// `text` as the value of an XML attribute.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

class VtpContactWriter final : public ContactWriter {
 public:
  VtpContactWriter(std::string stem, OutputFile index, const ContactFields& fields)
      : stem_(std::move(stem)), index_(std::move(index)), fields_(fields) {
    index_.write("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n");
  }

  Status write(std::uint64_t frame, const Positions& start, const Positions& end,
               std::span<const ContactRecord> contacts, std::span<const ContactGeometry> geometry) override {
    std::string number = std::to_string(frame);
    if (number.size() < 6) number.insert(0, 6 - number.size(), '0');
    const std::string path = stem_ + "_" + number + ".vtp";
    // The index lies beside the files, so it names them without their folder.
    const std::string name = path.substr(path.rfind('/') + 1);
    index_.write("<DataSet timestep=\"" + std::to_string(frame) + "\" part=\"0\" file=\"" + escaped(name) +
                 "\"/>\n");
    return write_file(path, format_vtp(frame, start, end, contacts, geometry, fields_));
  }

  Status close() override {
    index_.write("</Collection>\n</VTKFile>\n");
    return index_.close();
  }

 private:
  std::string stem_;
  OutputFile index_;
  const ContactFields fields_;
};

}  // namespace

Result<std::unique_ptr<ContactWriter>> open_vtp_contact_writer(const std::string& path,
                                                               const ContactFields& fields) {
  const std::string stem = path.ends_with(".vtp") ? path.substr(0, path.size() - 4) : path;
  Result<OutputFile> index = OutputFile::create(stem + ".pvd");
  if (!index) return index.error();
  return std::unique_ptr<ContactWriter>(
      std::make_unique<VtpContactWriter>(stem, std::move(index).value(), fields));
}

}  // namespace warmfront::client
