// SPDX-License-Identifier: Apache-2.0
// VTK PolyData files (.vtp) and the series (.pvd) that lists them, as ParaView opens them. One thread at a
// time each.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "client/io/endian.h"
#include "client/io/file.h"
#include "engine/result.h"

namespace warmfront::client {

/// Collects arrays: their descriptions for the XML, and their bytes for its appended section, raw, as
/// ParaView itself writes them: each is preceded by its size in bytes (uint64), and offsets count from the
/// mark "_".
class VtpArrays {
 public:
  /// The description of an array of `components` a tuple; `type` names T as VTK does.
  template <class T>
  std::string add(std::string_view type, std::string_view name, int components, std::span<const T> values) {
    std::string xml = "<DataArray type=\"" + std::string(type) + "\" Name=\"" + std::string(name) +
                      "\" NumberOfComponents=\"" + std::to_string(components) +
                      "\" format=\"appended\" offset=\"" + std::to_string(bytes_.size()) + "\"/>\n";
    append_little(bytes_, static_cast<std::uint64_t>(values.size_bytes()));
    for (const T value : values) append_little(bytes_, value);
    return xml;
  }

  /// The whole file, of one piece.
  struct Piece {
    std::size_t points = 0;
    std::size_t verts = 0;
    std::size_t lines = 0;
    std::size_t polys = 0;
    std::string content = {};  ///< PointData, CellData, Points, Verts, Lines, Polys
  };
  std::string format(const Piece& piece) const;

 private:
  std::string bytes_;
};

/// NAME_000001.vtp, ... and NAME.pvd beside them.
class VtpSeries {
 public:
  /// `path` with or without ".vtp". Nothing of it is there before close().
  static Result<VtpSeries> create(const std::string& path);

  /// The file of frame `number` of the series at `path`, with or without ".vtp".
  static std::string file_of(const std::string& path, std::uint64_t number);

  /// Writes the file of frame `number` and lists it.
  Status add(std::uint64_t number, std::string_view vtp);
  /// Ends the list; fails when anything written did not reach the file.
  Status close();

 private:
  VtpSeries(StagedFile staged, std::string stem, OutputFile index)
      : staged_(std::move(staged)), stem_(std::move(stem)), index_(std::move(index)) {}

  StagedFile staged_;
  std::string stem_;  // where it is staged
  OutputFile index_;
};

}  // namespace warmfront::client
