// SPDX-License-Identifier: Apache-2.0
// Contacts as CSV: see contact_writer.h.
#include <algorithm>

#include "client/io/contact_writer.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

class CsvContactWriter final : public ContactWriter {
 public:
  CsvContactWriter(OutputFile file, const WrittenFields& fields) : file_(std::move(file)), fields_(fields) {
    std::string header = ",toi,status";
    if (fields.weights) header += ",w0,w1,w2,w3";
    if (fields.normal) header += ",nx,ny,nz";
    if (fields.points) header += ",ax,ay,az,bx,by,bz";
    if (fields.direction) header += ",dx,dy,dz";
    if (fields.squared_distance) header += ",squared_distance";
    if (fields.closest) header += ",closest";
    if (fields.closest_pair) header += ",multiplicity,stencil";
    blank_.assign(static_cast<std::size_t>(std::ranges::count(header, ',')), ',');
    if (fields.continuity) header += ",continuity";
    file_.write("frame,type,v0,v1,v2,v3" + header + "\n");
  }

  Status write(std::uint64_t frame, const Positions&, const Positions&,
               std::span<const ContactRecord> contacts, std::span<const ContactGeometry> geometry) override {
    static const ContactGeometry kNone;
    std::string lines;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ContactRecord& contact = contacts[i];
      lines.append(std::to_string(frame)).append(",").append(short_name(contact.kind));
      for (const std::uint32_t v : contact.vertices) lines.append(",").append(std::to_string(v));
      if (contact.continuity == RowContinuity::kEnded)
        lines += blank_;
      else
        append_columns(lines, contact, fields_.any() ? geometry[i] : kNone);
      if (fields_.continuity) lines.append(",").append(to_string(contact.continuity));
      lines += '\n';
      if (lines.size() > kBlock) {
        file_.write(lines);
        lines.clear();
      }
    }
    file_.write(lines);
    return file_.flush();
  }

  Status close() override { return file_.close(); }

 private:
  void append_columns(std::string& lines, const ContactRecord& contact,
                      const ContactGeometry& geometry) const {
    const auto append_all = [&](std::span<const double> values) {
      for (const double value : values) append_round_trip(lines += ',', value);
    };
    append_round_trip(lines += ',', contact.toi);
    lines.append(",").append(to_string(contact.status));
    if (fields_.weights) append_all(geometry.weights);
    if (fields_.normal) append_all(geometry.normal);
    if (fields_.points) append_all(geometry.points);
    if (fields_.direction) append_all(geometry.direction);
    if (fields_.squared_distance) append_round_trip(lines += ',', geometry.squared_distance);
    if (fields_.closest) lines.append(",").append(short_name(geometry.closest));
    if (fields_.closest_pair)
      lines.append(",")
          .append(std::to_string(contact.closest_pair.multiplicity))
          .append(",")
          .append(std::to_string(contact.closest_pair.stencil));
  }

  // Lines are written in blocks of this many bytes.
  static constexpr std::size_t kBlock = std::size_t{1} << 16;
  std::string blank_;  // of a row that ended: a comma for each column from its time on
  OutputFile file_;
  const WrittenFields fields_;
};

}  // namespace

Result<std::unique_ptr<ContactWriter>> open_csv_contact_writer(const std::string& path,
                                                               const WrittenFields& fields) {
  Result<OutputFile> file = OutputFile::create_whole(path);
  if (!file) return file.error();
  return std::unique_ptr<ContactWriter>(std::make_unique<CsvContactWriter>(std::move(file).value(), fields));
}

}  // namespace warmfront::client
