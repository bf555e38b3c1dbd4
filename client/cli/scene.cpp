// SPDX-License-Identifier: Apache-2.0
// The verb `scene`: see scene.h.
#include "client/cli/scene.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/cli/progress.h"
#include "client/io/file.h"
#include "client/io/info_json.h"
#include "client/io/mdd.h"
#include "client/io/mesh.h"
#include "client/io/mesh_file.h"
#include "client/io/pc2.h"
#include "client/io/ply.h"
#include "client/scenes/catalog.h"

namespace warmfront::client {
namespace {

struct SceneArguments {
  std::string name;
  std::string folder;
  std::string triangles;
  std::string frames;
  std::string cache = "pc2";
  std::string json_file;
  bool list = false;
};

int list_scenes() {
  for (const scenes::CatalogEntry& entry : scenes::catalog())
    std::printf("%-12s %7u triangles %4u frames  %s\n", std::string(entry.name).c_str(), entry.triangles,
                entry.frames, std::string(entry.description).c_str());
  std::printf(
      "Parameters: triangles=%u..%u (about), frames=%u..%u, as in "
      "builtin:cloth-ball?triangles=10000&frames=30\n",
      scenes::kLeastTriangles, scenes::kMostTriangles, scenes::kLeastFrames, scenes::kMostFrames);
  return finish_output();
}

SceneInfo describe(const scenes::SceneSpec& spec, const SceneDescription& scene) {
  SceneInfo info;
  info.name = spec.entry->name;
  info.triangles = scene.faces.size();
  info.vertices = scene.vertex_count;
  info.frames = spec.frames;
  info.bodies = scene.bodies;
  info.excluded_pairs = scene.excluded_pairs;
  info.generator = "warmfront scene; " + std::string(spec.entry->description);
  return info;
}

/// Writes mesh.ply, frames.pc2 or frames.mdd, and info.json into the folder.
Status write_scene(const scenes::SceneSpec& spec, scenes::Animation& animation, const SceneInfo& info,
                   const std::filesystem::path& folder, bool mdd) {
  const Mesh mesh{animation.frame(0), animation.scene().faces, {}, animation.scene().edges};
  if (Status s = write_file((folder / "mesh.ply").string(), format_ply(mesh, info.name + " frame 0")); !s)
    return s;
  Pc2Header header;
  header.point_count = animation.scene().vertex_count;
  header.sample_count = spec.frames;
  const auto append_all = [&](auto cache) -> Status {
    if (!cache) return cache.error();
    Progress progress("frame", spec.frames);
    for (std::uint32_t frame = 0; frame < spec.frames; ++frame) {
      cache.value().append(animation.frame(frame));
      progress.update(frame + 1);
    }
    return cache.value().close();
  };
  const Status written =
      mdd ? append_all(MddWriter::create((folder / "frames.mdd").string(), {spec.frames, header.point_count},
                                         1 / info.fps))
          : append_all(Pc2Writer::create((folder / "frames.pc2").string(), header));
  if (!written) return written;
  return write_file((folder / "info.json").string(), format_info_json(info));
}

/// Frames of another scene would be taken for those of this one.
Status check_no_meshes(const std::string& folder) {
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed))
    if (is_mesh_file_name(entry.path().string()))
      return invalid_argument(folder + ": holds " + entry.path().filename().string() +
                              ", beside which a mesh a frame would be written; give an empty folder");
  return {};
}

/// A mesh a frame, and one more where the topology changes, behind the frame's own in the order of names.
Status write_meshes(const scenes::SceneSpec& spec, scenes::Animation& animation,
                    const std::vector<std::uint32_t>& changes, const std::filesystem::path& folder) {
  Progress progress("frame", spec.frames);
  std::size_t part = 0;
  const auto write = [&](std::uint32_t frame, const char* ending) {
    const SceneDescription scene = animation.scene(part);
    const Mesh mesh{animation.frame(frame, part), scene.faces, {}, scene.edges};
    char name[32];
    std::snprintf(name, sizeof name, "t%05u%s.ply", frame, ending);
    return write_file((folder / name).string(), format_ply(mesh, std::string(spec.entry->name)));
  };
  for (std::uint32_t frame = 0; frame < spec.frames; ++frame) {
    if (Status status = write(frame, ""); !status) return status;
    if (part < changes.size() && changes[part] == frame) {
      ++part;
      if (Status status = write(frame, "_changed"); !status) return status;
    }
    progress.update(frame + 1);
  }
  return {};
}

int scene(const SceneArguments& arguments) {
  if (arguments.list) return list_scenes();
  if (arguments.name.empty())
    return usage_error("scene: a NAME is needed; 'warmfront scene --list' lists them");
  Result<scenes::SceneSpec> parsed = scenes::parse_scene_spec(arguments.name);
  if (!parsed) return usage_error(parsed.error().message);
  scenes::SceneSpec& spec = parsed.value();
  for (const auto& [key, value] :
       {std::pair("triangles", arguments.triangles), std::pair("frames", arguments.frames)})
    if (!value.empty())
      if (const Status status = scenes::set_parameter(spec, key, value); !status)
        return usage_error(status.error().message);
  if (arguments.folder.empty()) return usage_error("scene: --out DIR is needed");

  if (const Status status = make_folder(arguments.folder); !status) return failure(status.error().message);
  const std::unique_ptr<scenes::Animation> animation = scenes::make_animation(spec);
  const SceneInfo info = describe(spec, animation->scene());
  const std::vector<std::uint32_t> changes = animation->changes();
  if (!animation->keeps_topology())
    if (const Status status = check_no_meshes(arguments.folder); !status)
      return failure(status.error().message);
  if (const Status status = animation->keeps_topology()
                                ? write_scene(spec, *animation, info, arguments.folder, arguments.cache == "mdd")
                                : write_meshes(spec, *animation, changes, arguments.folder);
      !status)
    return failure(status.error().message);
  if (!arguments.json_file.empty()) {
    if (const Status status = write_text(arguments.json_file, format_info_json(info)); !status)
      return failure(status.error().message);
  }
  if (arguments.json_file != "-" && !animation->keeps_topology())
    std::printf(
        "%s: a mesh a frame, and another at each of %zu frames at which the topology changes; at first:\n",
        arguments.folder.c_str(), changes.size());
  if (arguments.json_file != "-")
    std::printf("%s: %llu triangles, %zu edges besides, %llu vertices, %zu bodies, %u frames\n",
                arguments.folder.c_str(), static_cast<unsigned long long>(info.triangles),
                animation->scene().edges.size(), static_cast<unsigned long long>(info.vertices),
                info.bodies.size(), spec.frames);
  return finish_output();
}

}  // namespace

Verb add_scene(CLI::App& app) {
  auto arguments = std::make_shared<SceneArguments>();
  SceneArguments& a = *arguments;
  app.add_option("NAME", a.name, "A built-in scene (see --list)");
  app.add_option(
         "--out", a.folder,
         "Folder for mesh.ply, frames.pc2 and info.json, or, where the topology changes, for a mesh a frame "
         "as `detect --remeshed` takes them; created if missing")
      ->type_name("DIR");
  app.add_option("--cache", a.cache, "Format of the frames: frames.pc2, or frames.mdd")
      ->check(CLI::IsMember({"pc2", "mdd"}))
      ->capture_default_str();
  app.add_option("--triangles", a.triangles, "Approximate number of triangles")->type_name("N");
  app.add_option("--frames", a.frames, "Number of frames")->type_name("N");
  app.add_option("--json", a.json_file,
                 "Also write the content of info.json here; - for stdout, without other output")
      ->type_name("FILE");
  app.add_flag("--list", a.list, "List the built-in scenes and their parameters");
  return [arguments] { return scene(*arguments); };
}

}  // namespace warmfront::client
