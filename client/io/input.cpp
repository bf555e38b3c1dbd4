// SPDX-License-Identifier: Apache-2.0
// Selects the kind of input, and the built-in ones: see input.h.
#include "client/io/input.h"

#include <algorithm>

#include "client/io/mesh_file.h"
#include "client/io/point_cache.h"
#include "client/io/text.h"
#include "client/scenes/catalog.h"

namespace warmfront::client {
namespace {

class BuiltinInput final : public Input {
 public:
  /// Part number `part` of the animation.
  BuiltinInput(std::string name, std::shared_ptr<scenes::Animation> animation, std::size_t part,
               std::uint32_t frames)
      : Input(std::move(name), animation->scene(part), frames),
        animation_(std::move(animation)),
        part_(part) {}

  Status read_frame(std::uint32_t index, PositionBuffer& positions) override {
    if (index >= frame_count()) return invalid_argument(name() + ": no frame " + std::to_string(index));
    positions = animation_->frame(first_number() + index, part_);
    return {};
  }

 private:
  const std::shared_ptr<scenes::Animation> animation_;
  const std::size_t part_;
};

Result<std::unique_ptr<Input>> open_builtin_input(const std::string& name, TopologyChanges changes) {
  const Result<scenes::SceneSpec> spec = scenes::parse_scene_spec(name);
  if (!spec) return spec.error();
  const std::shared_ptr<scenes::Animation> animation = scenes::make_animation(spec.value());
  std::vector<std::uint32_t> starts = animation->changes();
  if (!starts.empty() && changes == TopologyChanges::kRefused)
    return invalid_argument(name + ": its topology changes at frame " + std::to_string(starts.front()) +
                            ", which `warmfront detect` follows and this does not");
  starts.insert(starts.begin(), 0);
  starts.push_back(spec.value().frames - 1);
  std::unique_ptr<Input> first;
  Input* last = nullptr;
  for (std::size_t part = 0; part + 1 < starts.size(); ++part) {
    auto made = std::make_unique<BuiltinInput>(name, animation, part, starts[part + 1] - starts[part] + 1);
    Input* const here = made.get();
    if (last == nullptr)
      first = std::move(made);
    else
      last->set_next(std::move(made));
    last = here;
  }
  return first;
}

}  // namespace

Status check_input_arguments(std::span<const std::string> arguments, std::size_t least_frames) {
  if (arguments.empty()) return invalid_argument("an input is needed: a folder, mesh files, or builtin:NAME");
  const auto is_builtin = [](const std::string& a) { return a.starts_with(scenes::kBuiltinPrefix); };
  if (arguments.size() == 1) {
    if (is_builtin(arguments[0])) {
      const Result<scenes::SceneSpec> spec = scenes::parse_scene_spec(arguments[0]);
      return spec ? Status() : Status(spec.error());
    }
    if (is_mesh_file_name(arguments[0]) && least_frames > 1)
      return invalid_argument(arguments[0] +
                              " is one frame: give two or more mesh files, a cache of positions after it, or a folder");
    if (is_point_cache_name(arguments[0]))
      return invalid_argument(arguments[0] + " has positions alone: give the mesh file before it");
    return {};
  }
  const auto cache = std::ranges::find_if(arguments, is_point_cache_name);
  if (cache != arguments.end()) {
    if (arguments.size() == 2 && cache == arguments.begin() + 1 && is_mesh_file_name(arguments[0])) return {};
    return invalid_argument(*cache + ": a cache comes after one mesh file (.ply, .obj or .stl), and nothing else");
  }
  for (const std::string& argument : arguments) {
    if (is_builtin(argument)) return invalid_argument(argument + " stands alone: give no other input");
    if (!is_mesh_file_name(argument))
      return invalid_argument(argument + ": of several inputs each must be a mesh file (.ply, .obj or .stl)");
  }
  return {};
}

Status rest_at_first_frame(Input& input, SceneDescription& scene) {
  if (!(scene.filters.near_at_rest > 0) || !scene.filters.rest_positions.empty()) return {};
  PositionBuffer first;
  if (Status status = input.read_frame(0, first); !status) return status;
  scene.filters.rest_at(view(first));
  return {};
}

std::uint32_t frames_of_all_parts(const Input& first) {
  const Input* last = &first;
  while (last->next() != nullptr) last = last->next();
  return last->first_number() + last->frame_count();
}

Result<std::unique_ptr<Input>> open_input(std::span<const std::string> arguments, std::size_t least_frames,
                                          TopologyChanges changes) {
  if (const Status status = check_input_arguments(arguments, least_frames); !status) return status.error();
  const std::string& name = arguments[0];
  if (arguments.size() == 2 && is_point_cache_name(arguments[1]))
    return open_mesh_and_cache_input(name, arguments[1], least_frames);
  const bool builtin = name.starts_with(scenes::kBuiltinPrefix);
  if (arguments.size() > 1 || (!builtin && is_mesh_file_name(name)))
    return open_mesh_files_input(arguments, least_frames, changes);
  if (!builtin && has_ending(name, ".npz")) return open_npz_input(name, least_frames);
  return builtin ? open_builtin_input(name, changes) : open_folder_input(name, least_frames);
}

}  // namespace warmfront::client
