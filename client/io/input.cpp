// SPDX-License-Identifier: Apache-2.0
// Selects the kind of input, and the built-in ones: see input.h.
#include "client/io/input.h"

#include "client/io/mesh_file.h"
#include "client/scenes/catalog.h"

namespace warmfront::client {
namespace {

class BuiltinInput final : public Input {
 public:
  BuiltinInput(std::string name, std::unique_ptr<scenes::Animation> animation, std::uint32_t frames)
      : Input(std::move(name), animation->scene(), frames), animation_(std::move(animation)) {}

  Status read_frame(std::uint32_t index, PositionBuffer& positions) override {
    if (index >= frame_count()) return invalid_argument(name() + ": no frame " + std::to_string(index));
    positions = animation_->frame(index);
    return {};
  }

 private:
  std::unique_ptr<scenes::Animation> animation_;
};

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
      return invalid_argument(arguments[0] + " is one frame: give two or more mesh files, or a folder");
    return {};
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

Result<std::unique_ptr<Input>> open_input(std::span<const std::string> arguments, std::size_t least_frames) {
  if (const Status status = check_input_arguments(arguments, least_frames); !status) return status.error();
  const std::string& name = arguments[0];
  const bool builtin = name.starts_with(scenes::kBuiltinPrefix);
  if (arguments.size() > 1 || (!builtin && is_mesh_file_name(name)))
    return open_mesh_files_input(arguments, least_frames);
  if (!builtin) return open_folder_input(name, least_frames);
  const Result<scenes::SceneSpec> spec = scenes::parse_scene_spec(name);
  if (!spec) return spec.error();
  return std::unique_ptr<Input>(
      std::make_unique<BuiltinInput>(name, scenes::make_animation(spec.value()), spec.value().frames));
}

}  // namespace warmfront::client
