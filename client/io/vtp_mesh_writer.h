// SPDX-License-Identifier: Apache-2.0
// Writes the meshes as a series of VTK PolyData files, frame by frame. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/io/contact_record.h"
#include "client/io/vtp.h"
#include "engine/frame.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

/// NAME_000000.vtp, ... and NAME.pvd: triangles and lone edges; per vertex `toi`, the least time of impact of
/// its contacts in the step, NaN if none; per edge and triangle `body`.
class VtpMeshWriter {
 public:
  static Result<VtpMeshWriter> create(const std::string& path, const SceneDescription& scene);

  /// The frames from the next one on are of this scene.
  void take_scene(const SceneDescription& scene);

  /// The positions at frame `number`, and the contacts of the step that ends there.
  Status write(std::uint64_t number, const Positions& positions, std::span<const ContactRecord> contacts);
  Status close() { return series_.close(); }

 private:
  explicit VtpMeshWriter(VtpSeries series) : series_(std::move(series)) {}

  VtpSeries series_;
  // Cells of one kind, as VTK lists them.
  struct Cells {
    std::vector<std::int64_t> corners;
    std::vector<std::int64_t> ends;  // of each cell's corners

    std::string format(VtpArrays& arrays, const std::string& kind) const;
  };

  Cells lines_;
  Cells triangles_;
  std::vector<std::uint32_t> bodies_;  // of each line, then of each triangle
};

}  // namespace warmfront::client
