// SPDX-License-Identifier: Apache-2.0
// VTK's XML: see vtp.h.
#include "client/io/vtp.h"

namespace warmfront::client {
namespace {

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

}  // namespace

std::string VtpArrays::format(const Piece& piece) const {
  return "<?xml version=\"1.0\"?>\n"
         "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
         "<PolyData>\n<Piece NumberOfPoints=\"" +
         std::to_string(piece.points) + "\" NumberOfVerts=\"" + std::to_string(piece.verts) +
         "\" NumberOfLines=\"" + std::to_string(piece.lines) + "\" NumberOfStrips=\"0\" NumberOfPolys=\"" +
         std::to_string(piece.polys) + "\">\n" + piece.content +
         "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_" + bytes_ +
         "\n</AppendedData>\n</VTKFile>\n";
}

namespace {

std::string stem_of(const std::string& path) {
  return path.ends_with(".vtp") ? path.substr(0, path.size() - 4) : path;
}

}  // namespace

std::string VtpSeries::file_of(const std::string& path, std::uint64_t number) {
  std::string digits = std::to_string(number);
  if (digits.size() < 6) digits.insert(0, 6 - digits.size(), '0');
  return stem_of(path) + "_" + digits + ".vtp";
}

Result<VtpSeries> VtpSeries::create(const std::string& path) {
  Result<StagedFile> staged = StagedFile::create(path);
  if (!staged) return staged.error();
  std::string stem = stem_of(staged.value().path());
  Result<OutputFile> index = OutputFile::create(stem + ".pvd");
  if (!index) return index.error();
  index.value().write(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n");
  return VtpSeries(std::move(staged).value(), std::move(stem), std::move(index).value());
}

Status VtpSeries::add(std::uint64_t number, std::string_view vtp) {
  const std::string path = file_of(stem_, number);
  // The index is in the same folder, so it lists names without a path.
  const std::string name = path.substr(path.rfind('/') + 1);
  index_.write("<DataSet timestep=\"" + std::to_string(number) + "\" part=\"0\" file=\"" + escaped(name) +
               "\"/>\n");
  return write_file(path, vtp);
}

Status VtpSeries::close() {
  index_.write("</Collection>\n</VTKFile>\n");
  if (Status status = index_.close(); !status) return status;
  return staged_.commit();
}

}  // namespace warmfront::client
