// SPDX-License-Identifier: Apache-2.0
// Contacts as CSV: see contact_writer.h.
#include "client/io/contact_writer.h"
#include "client/io/file.h"

namespace warmfront::client {
namespace {

class CsvContactWriter final : public ContactWriter {
 public:
  explicit CsvContactWriter(OutputFile file) : file_(std::move(file)) {
    file_.write("frame,type,v0,v1,v2,v3,toi\n");
  }

  Status write(std::uint64_t frame, const Positions&, const Positions&,
               std::span<const ContactRecord> contacts) override {
    std::string lines;
    for (const ContactRecord& contact : contacts) {
      lines.append(std::to_string(frame)).append(",").append(short_name(contact.kind));
      for (const std::uint32_t v : contact.vertices) lines.append(",").append(std::to_string(v));
      lines += ',';
      append_round_trip(lines, contact.toi);
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
  // Lines are gathered to this many bytes, however many contacts a frame has.
  static constexpr std::size_t kBlock = std::size_t{1} << 16;
  OutputFile file_;
};

}  // namespace

Result<std::unique_ptr<ContactWriter>> open_csv_contact_writer(const std::string& path) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  return std::unique_ptr<ContactWriter>(std::make_unique<CsvContactWriter>(std::move(file).value()));
}

}  // namespace warmfront::client
