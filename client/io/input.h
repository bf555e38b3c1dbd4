// SPDX-License-Identifier: Apache-2.0
// The input of a command: a scene and its frames, from any source. One thread at a time each.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/io/mesh.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

/// What an input may be whose topology changes between two frames.
enum class TopologyChanges : std::uint8_t {
  kRefused,  ///< an error
  kBuiltin,  ///< a built-in scene that says so
  kAny,      ///< mesh files, too: one with another topology stands for the same moment as the file before it
};

/// A scene and its frames. One whose topology changes is a list of parts, each an Input with frames of its
/// own, of which the first one is a state of the same moment as the last one of the part before it.
class Input {
 public:
  virtual ~Input() = default;

  /// Display name: a path or "builtin:...".
  const std::string& name() const { return name_; }
  /// Faces, edges, vertex count, and the bodies if the source declares them.
  const SceneDescription& scene() const { return scene_; }
  /// Warnings for people, a sentence each: what the scene omits from the source.
  const std::vector<std::string>& notes() const { return notes_; }
  /// At least as many as open_input() was asked for, unless it is one part of several.
  std::uint32_t frame_count() const { return frame_count_; }
  /// The number of its frame 0 in the whole input: 0, except of a part that follows another.
  std::uint32_t first_number() const { return first_number_; }
  /// The part that follows; null if none does.
  Input* next() const { return next_.get(); }
  /// Makes it the part that follows.
  void set_next(std::unique_ptr<Input> next) {
    next->first_number_ = first_number_ + frame_count_ - 1;
    next_ = std::move(next);
  }

  /// Reads frame `index` in [0, frame_count) into `positions`, (n, 3), in the source's precision. In any
  /// order; ascending is fastest. Fails when the source cannot be read or does not fit the scene; the message
  /// says where.
  virtual Status read_frame(std::uint32_t index, PositionBuffer& positions) = 0;

 protected:
  Input(Input&&) = default;
  Input(std::string name, SceneDescription scene, std::uint32_t frame_count,
        std::vector<std::string> notes = {})
      : name_(std::move(name)),
        scene_(std::move(scene)),
        notes_(std::move(notes)),
        frame_count_(frame_count) {}

 private:
  std::string name_;
  SceneDescription scene_;
  std::vector<std::string> notes_;
  std::uint32_t frame_count_;
  std::uint32_t first_number_ = 0;
  std::unique_ptr<Input> next_;
};

/// Frames in all parts: those of a moment at which the topology changes count as one.
std::uint32_t frames_of_all_parts(const Input& first);

/// Checks the form of the arguments without opening a file; an error says what to give. They are
/// - one folder with mesh.ply and frames.pc2 (or frames.mdd), or with t0.ply, t1.ply, ...; and info.json (info_json.h) for
///   the bodies, filters and thickness;
/// - two or more mesh files (.ply, .obj, .stl) of one topology, which are successive frames; or one, where
///   `least_frames` is 1;
/// - a mesh file and a cache of its vertices' positions (.pc2, .mdd, .npy), in this order;
/// - one .npz file with the arrays `positions` (frames, n, 3), `faces` (m, 3) and perhaps `edges` (k, 2);
/// - one `builtin:NAME`, with `?key=value&...` (client/scenes/catalog.h).
/// With TopologyChanges::kAny mesh files may differ in topology; each is then read twice.
Status check_input_arguments(std::span<const std::string> arguments, std::size_t least_frames = 2);

/// Opens what check_input_arguments() describes. Fails when something is missing, malformed, or does not fit
/// together.
Result<std::unique_ptr<Input>> open_input(std::span<const std::string> arguments,
                                          std::size_t least_frames = 2,
                                          TopologyChanges changes = TopologyChanges::kRefused);

/// Where the scene's filters need a rest shape and have none, it is the input's first frame.
Status rest_at_first_frame(Input& input, SceneDescription& scene);

/// Opens one folder, a mesh with its cache, a .npz file, and mesh files.
Result<std::unique_ptr<Input>> open_folder_input(const std::string& folder, std::size_t least_frames = 2);
Result<std::unique_ptr<Input>> open_mesh_and_cache_input(const std::string& mesh, const std::string& cache,
                                                         std::size_t least_frames = 2);
Result<std::unique_ptr<Input>> open_npz_input(const std::string& path, std::size_t least_frames = 2);
Result<std::unique_ptr<Input>> open_mesh_files_input(std::span<const std::string> paths,
                                                     std::size_t least_frames = 2,
                                                     TopologyChanges changes = TopologyChanges::kRefused);

}  // namespace warmfront::client
