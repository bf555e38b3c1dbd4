// SPDX-License-Identifier: Apache-2.0
// Contacts as JSON lines: see contact_writer.h.
#include "client/io/contact_writer.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

class JsonlContactWriter final : public ContactWriter {
 public:
  JsonlContactWriter(OutputFile file, const WrittenFields& fields)
      : file_(std::move(file)), fields_(fields) {}

  Status write(std::uint64_t frame, const Positions&, const Positions&,
               std::span<const ContactRecord> contacts, std::span<const ContactGeometry> geometry) override {
    static const ContactGeometry kNone;
    std::string lines;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ContactRecord& contact = contacts[i];
      lines.append("{\"frame\":").append(std::to_string(frame));
      lines.append(",\"type\":\"").append(short_name(contact.kind)).append("\"");
      for (std::size_t k = 0; k < contact.vertices.size(); ++k)
        lines.append(",\"v")
            .append(std::to_string(k))
            .append("\":")
            .append(std::to_string(contact.vertices[k]));
      if (contact.continuity != RowContinuity::kEnded)
        append_told(lines, contact, fields_.any() ? geometry[i] : kNone);
      if (fields_.continuity)
        lines.append(",\"continuity\":\"").append(to_string(contact.continuity)).append("\"");
      lines += "}\n";
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
  void append_told(std::string& lines, const ContactRecord& contact, const ContactGeometry& geometry) const {
    const auto append_list = [&](std::span<const double> values) {
      for (std::size_t k = 0; k < values.size(); ++k)
        append_round_trip(lines += k == 0 ? '[' : ',', values[k]);
      lines += ']';
    };
    const auto append_list_of = [&](std::string_view name, std::span<const double> values) {
      lines.append(",\"").append(name).append("\":");
      append_list(values);
    };
    lines += ",\"toi\":";
    append_round_trip(lines, contact.toi);
    lines.append(",\"status\":\"").append(to_string(contact.status)).append("\"");
    if (fields_.weights) append_list_of("weights", geometry.weights);
    if (fields_.normal) append_list_of("normal", geometry.normal);
    if (fields_.points) {
      lines += ",\"points\":[";
      append_list(std::span(geometry.points).first(3));
      lines += ',';
      append_list(std::span(geometry.points).last(3));
      lines += ']';
    }
    if (fields_.direction) append_list_of("direction", geometry.direction);
    if (fields_.squared_distance)
      append_round_trip(lines += ",\"squared_distance\":", geometry.squared_distance);
    if (fields_.closest) lines.append(",\"closest\":\"").append(short_name(geometry.closest)).append("\"");
    if (fields_.closest_pair)
      lines.append(",\"multiplicity\":")
          .append(std::to_string(contact.closest_pair.multiplicity))
          .append(",\"stencil\":")
          .append(std::to_string(contact.closest_pair.stencil));
  }

  // Lines are written in blocks of this many bytes.
  static constexpr std::size_t kBlock = std::size_t{1} << 16;
  OutputFile file_;
  const WrittenFields fields_;
};

}  // namespace

Result<std::unique_ptr<ContactWriter>> open_jsonl_contact_writer(const std::string& path,
                                                                 const WrittenFields& fields) {
  Result<OutputFile> file = OutputFile::create_whole(path);
  if (!file) return file.error();
  return std::unique_ptr<ContactWriter>(
      std::make_unique<JsonlContactWriter>(std::move(file).value(), fields));
}

}  // namespace warmfront::client
