// SPDX-License-Identifier: Apache-2.0
// Contacts as JSON lines: see contact_writer.h.
#include "client/io/contact_writer.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

class JsonlContactWriter final : public ContactWriter {
 public:
  explicit JsonlContactWriter(OutputFile file) : file_(std::move(file)) {}

  Status write(std::uint64_t frame, const Positions&, const Positions&,
               std::span<const ContactRecord> contacts) override {
    std::string lines;
    for (const ContactRecord& contact : contacts) {
      lines.append("{\"frame\":").append(std::to_string(frame));
      lines.append(",\"type\":\"").append(short_name(contact.kind)).append("\"");
      for (std::size_t k = 0; k < contact.vertices.size(); ++k)
        lines.append(",\"v")
            .append(std::to_string(k))
            .append("\":")
            .append(std::to_string(contact.vertices[k]));
      lines += ",\"toi\":";
      append_round_trip(lines, contact.toi);
      lines.append(",\"status\":\"").append(to_string(contact.status)).append("\"}\n");
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
  // Lines are gathered to this many bytes, however many contacts a frame has.
  static constexpr std::size_t kBlock = std::size_t{1} << 16;
  OutputFile file_;
};

}  // namespace

Result<std::unique_ptr<ContactWriter>> open_jsonl_contact_writer(const std::string& path) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  return std::unique_ptr<ContactWriter>(std::make_unique<JsonlContactWriter>(std::move(file).value()));
}

}  // namespace warmfront::client
