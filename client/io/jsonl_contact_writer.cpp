// SPDX-License-Identifier: Apache-2.0
// Contacts as JSON lines: see contact_writer.h.
#include "client/io/contact_writer.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

class JsonlContactWriter final : public ContactWriter {
 public:
  JsonlContactWriter(OutputFile file, const ContactFields& fields)
      : file_(std::move(file)), fields_(fields) {}

  Status write(std::uint64_t frame, const Positions&, const Positions&,
               std::span<const ContactRecord> contacts, std::span<const ContactGeometry> geometry) override {
    std::string lines;
    const auto append_list = [&](std::span<const double> values) {
      for (std::size_t k = 0; k < values.size(); ++k)
        append_round_trip(lines += k == 0 ? '[' : ',', values[k]);
      lines += ']';
    };
    const auto append_list_of = [&](std::string_view name, std::span<const double> values) {
      lines.append(",\"").append(name).append("\":");
      append_list(values);
    };
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ContactRecord& contact = contacts[i];
      lines.append("{\"frame\":").append(std::to_string(frame));
      lines.append(",\"type\":\"").append(short_name(contact.kind)).append("\"");
      for (std::size_t k = 0; k < contact.vertices.size(); ++k)
        lines.append(",\"v")
            .append(std::to_string(k))
            .append("\":")
            .append(std::to_string(contact.vertices[k]));
      lines += ",\"toi\":";
      append_round_trip(lines, contact.toi);
      lines.append(",\"status\":\"").append(to_string(contact.status)).append("\"");
      if (fields_.weights) append_list_of("weights", geometry[i].weights);
      if (fields_.normal) append_list_of("normal", geometry[i].normal);
      if (fields_.points) {
        lines += ",\"points\":[";
        append_list(std::span(geometry[i].points).first(3));
        lines += ',';
        append_list(std::span(geometry[i].points).last(3));
        lines += ']';
      }
      if (fields_.direction) append_list_of("direction", geometry[i].direction);
      if (fields_.squared_distance)
        append_round_trip(lines += ",\"squared_distance\":", geometry[i].squared_distance);
      if (fields_.closest)
        lines.append(",\"closest\":\"").append(short_name(geometry[i].closest)).append("\"");
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
  // Lines are written in blocks of this many bytes.
  static constexpr std::size_t kBlock = std::size_t{1} << 16;
  OutputFile file_;
  const ContactFields fields_;
};

}  // namespace

Result<std::unique_ptr<ContactWriter>> open_jsonl_contact_writer(const std::string& path,
                                                                 const ContactFields& fields) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  return std::unique_ptr<ContactWriter>(
      std::make_unique<JsonlContactWriter>(std::move(file).value(), fields));
}

}  // namespace warmfront::client
