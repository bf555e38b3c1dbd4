// SPDX-License-Identifier: Apache-2.0
// Contacts as CSV: see contact_writer.h.
#include "client/io/contact_writer.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

class CsvContactWriter final : public ContactWriter {
 public:
  CsvContactWriter(OutputFile file, const ContactFields& fields) : file_(std::move(file)), fields_(fields) {
    std::string header = "frame,type,v0,v1,v2,v3,toi,status";
    if (fields.weights) header += ",w0,w1,w2,w3";
    if (fields.normal) header += ",nx,ny,nz";
    if (fields.points) header += ",ax,ay,az,bx,by,bz";
    if (fields.direction) header += ",dx,dy,dz";
    if (fields.squared_distance) header += ",squared_distance";
    if (fields.closest) header += ",closest";
    file_.write(header + "\n");
  }

  Status write(std::uint64_t frame, const Positions&, const Positions&,
               std::span<const ContactRecord> contacts, std::span<const ContactGeometry> geometry) override {
    std::string lines;
    const auto append_all = [&](std::span<const double> values) {
      for (const double value : values) append_round_trip(lines += ',', value);
    };
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ContactRecord& contact = contacts[i];
      lines.append(std::to_string(frame)).append(",").append(short_name(contact.kind));
      for (const std::uint32_t v : contact.vertices) lines.append(",").append(std::to_string(v));
      lines += ',';
      append_round_trip(lines, contact.toi);
      lines.append(",").append(to_string(contact.status));
      if (fields_.weights) append_all(geometry[i].weights);
      if (fields_.normal) append_all(geometry[i].normal);
      if (fields_.points) append_all(geometry[i].points);
      if (fields_.direction) append_all(geometry[i].direction);
      if (fields_.squared_distance) append_round_trip(lines += ',', geometry[i].squared_distance);
      if (fields_.closest) lines.append(",").append(short_name(geometry[i].closest));
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
  // Lines are written in blocks of this many bytes.
  static constexpr std::size_t kBlock = std::size_t{1} << 16;
  OutputFile file_;
  const ContactFields fields_;
};

}  // namespace

Result<std::unique_ptr<ContactWriter>> open_csv_contact_writer(const std::string& path,
                                                               const ContactFields& fields) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  return std::unique_ptr<ContactWriter>(std::make_unique<CsvContactWriter>(std::move(file).value(), fields));
}

}  // namespace warmfront::client
