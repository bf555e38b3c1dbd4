// SPDX-License-Identifier: Apache-2.0
// The built-in scenes by name: small models that resemble the five benchmarks of Tang, Manocha and Tong 2009,
// so that a demo or test needs no file. They are not the paper's data: do not compare their times with the
// paper's. Functions are thread-safe; an Animation is used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client::scenes {

class Model;

inline constexpr std::string_view kBuiltinPrefix = "builtin:";
inline constexpr std::uint32_t kLeastTriangles = 1'000, kMostTriangles = 1'000'000;
inline constexpr std::uint32_t kLeastFrames = 2, kMostFrames = 10'000;

struct CatalogEntry {
  std::string_view name;
  std::string_view description;
  std::uint32_t triangles;  ///< by default
  std::uint32_t frames;     ///< by default
  std::unique_ptr<Model> (*make)(std::uint32_t triangles);
};
std::span<const CatalogEntry> catalog();

/// Name, size and length of a scene.
struct SceneSpec {
  const CatalogEntry* entry = nullptr;
  std::uint32_t triangles = 0;  ///< approximate: a model rounds to whole grids
  std::uint32_t frames = 0;
};

/// Reads `[builtin:]NAME[?triangles=N&frames=N]`. Fails with a message that lists what exists.
Result<SceneSpec> parse_scene_spec(std::string_view text);

/// Sets a parameter ("triangles" or "frames") from text; an error names the range.
Status set_parameter(SceneSpec& spec, std::string_view key, std::string_view value);

/// A scene frame by frame, with the same bits every time: float32, as it would be in a file.
class Animation {
 public:
  explicit Animation(const SceneSpec& spec);
  ~Animation();

  /// The frames at which its topology changes, ascending, first and last frame excluded: mostly none. Part 0
  /// of it ends at the first of them, where part 1 starts.
  std::vector<std::uint32_t> changes() const;
  /// Whether it never changes, however many frames are asked for.
  bool keeps_topology() const;
  SceneDescription scene(std::size_t part = 0) const;

  /// (n, 3) positions of frame `index`, which is one of this part's, valid until the next call. Each next
  /// frame is one step of the model; an earlier frame restarts it.
  const std::vector<float>& frame(std::uint32_t index, std::size_t part = 0);

 private:
  SceneSpec spec_;
  std::unique_ptr<Model> model_;
  std::uint32_t current_ = 0;
  std::vector<float> positions_;
};
std::unique_ptr<Animation> make_animation(const SceneSpec& spec);

}  // namespace warmfront::client::scenes
