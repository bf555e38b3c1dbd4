// SPDX-License-Identifier: Apache-2.0
// Inputs from files: see input.h. Frames are read on demand, so that long sequences need little memory.
#include <filesystem>
#include <optional>
#include <utility>

#include "client/io/file.h"
#include "client/io/file_order.h"
#include "client/io/info_json.h"
#include "client/io/input.h"
#include "client/io/mesh_file.h"
#include "client/io/npy.h"
#include "client/io/point_cache.h"

namespace warmfront::client {
namespace {

namespace fs = std::filesystem;

SceneDescription describe(Mesh& mesh) {
  SceneDescription scene;
  scene.vertex_count = static_cast<std::uint32_t>(vertex_count(mesh.positions));
  scene.faces = std::move(mesh.faces);
  scene.edges = std::move(mesh.edges);
  return scene;
}

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// What the folder's info.json says, if there is one; not yet the rest shape.
Status add_info(const fs::path& folder, SceneDescription& scene) {
  const fs::path path = folder / "info.json";
  if (!is_there(path)) return {};
  const Result<std::string> bytes = read_file(path.string());
  if (!bytes) return bytes.error();
  Result<SceneInfo> info = parse_info_json(bytes.value(), path.string());
  if (!info) return info.error();
  scene.bodies = std::move(info.value().bodies);
  scene.excluded_pairs = std::move(info.value().excluded_pairs);
  scene.filters = std::move(info.value().filters);
  scene.thickness = std::move(info.value().thickness);
  return {};
}

/// A mesh and its point cache.
class CacheInput final : public Input {
 public:
  CacheInput(std::string name, SceneDescription scene, std::unique_ptr<PointCache> cache,
             std::vector<std::string> notes)
      : Input(std::move(name), std::move(scene), cache->frame_count(), std::move(notes)),
        cache_(std::move(cache)) {}

  Status read_frame(std::uint32_t index, PositionBuffer& positions) override {
    return cache_->read(index, positions);
  }

 private:
  std::unique_ptr<PointCache> cache_;
};

/// The arrays of a .npz file.
class NpzInput final : public Input {
 public:
  NpzInput(std::string name, SceneDescription scene, NpyArray positions, std::vector<std::string> notes)
      : Input(std::move(name), std::move(scene), static_cast<std::uint32_t>(positions.header().shape[0]),
              std::move(notes)),
        positions_(std::move(positions)) {}

  Status read_frame(std::uint32_t index, PositionBuffer& positions) override {
    return positions_.read_frame(index, positions);
  }

 private:
  NpyArray positions_;
};

using Faces = std::vector<std::array<std::int32_t, 3>>;

/// The first difference between a frame's mesh and the scene's, whose file listed `listed`.
std::optional<std::string> difference(const SceneDescription& scene, const Faces& listed, const Mesh& mesh) {
  const std::size_t vertices = vertex_count(mesh.positions);
  if (vertices != scene.vertex_count)
    return std::to_string(vertices) + " vertices, not " + std::to_string(scene.vertex_count);
  if (mesh.faces.size() != listed.size())
    return std::to_string(mesh.faces.size()) + " triangles, not " + std::to_string(listed.size());
  if (mesh.edges != scene.edges)
    return mesh.edges.size() != scene.edges.size()
               ? std::to_string(mesh.edges.size()) + " edges, not " + std::to_string(scene.edges.size())
               : std::string("other edges");
  // One frame may list polygons, and another their triangles.
  if (mesh.polygons.empty() && mesh.faces == scene.faces) return std::nullopt;
  const auto text = [](const std::array<std::int32_t, 3>& f) {
    std::string corners;
    for (const std::int32_t v : f) corners.append(corners.empty() ? "(" : ", ").append(std::to_string(v));
    return corners.append(")");
  };
  for (std::size_t i = 0; i < mesh.faces.size(); ++i)
    if (mesh.faces[i] != listed[i])
      return "triangle " + std::to_string(i) + " is " + text(mesh.faces[i]) + ", not " + text(listed[i]);
  return std::nullopt;
}

/// A mesh file a frame.
class MeshFilesInput final : public Input {
 public:
  MeshFilesInput(std::string name, SceneDescription scene, std::vector<std::string> paths, Faces listed,
                 PositionBuffer first, std::vector<std::string> notes)
      : Input(std::move(name), std::move(scene), static_cast<std::uint32_t>(paths.size()), std::move(notes)),
        paths_(std::move(paths)),
        listed_(std::move(listed)),
        first_(std::move(first)) {}

  Status read_frame(std::uint32_t index, PositionBuffer& positions) override {
    if (index >= frame_count()) return invalid_argument(name() + ": no frame " + std::to_string(index));
    if (index == 0) {
      positions = first_;
      return {};
    }
    Result<Mesh> mesh = read_listed_mesh(paths_[index]);
    if (!mesh) return mesh.error();
    if (const auto what = difference(scene(), listed_.empty() ? scene().faces : listed_, mesh.value()))
      return invalid_argument(paths_[index] + ": another topology than " + paths_[0] + ": " + *what +
                              "; where meshes are remeshed, `warmfront detect --remeshed` follows");
    positions = std::move(mesh.value().positions);
    return {};
  }

 private:
  std::vector<std::string> paths_;
  // As listed in the first file, if it has polygons: their triangulation depends on its positions.
  Faces listed_;
  PositionBuffer first_;
};

/// How many files from the first one on have its topology.
Result<std::size_t> count_alike(std::span<const std::string> paths) {
  Result<Mesh> first = read_listed_mesh(paths[0]);
  if (!first) return first.error();
  const Faces listed = first.value().faces;
  if (const Status status = make_scene_mesh(first.value(), paths[0]); !status) return status.error();
  const SceneDescription scene = describe(first.value());
  std::size_t alike = 1;
  for (; alike < paths.size(); ++alike) {
    const Result<Mesh> mesh = read_listed_mesh(paths[alike]);
    if (!mesh) return mesh.error();
    if (difference(scene, listed, mesh.value())) break;
  }
  return alike;
}

Error too_few_frames(const std::string& path, std::uint64_t frames, std::size_t least_frames) {
  return invalid_argument(path + ": " + std::to_string(frames) + " frames, but " +
                          std::to_string(least_frames) + " are needed");
}

/// In the scene what info.json says in `folder`, if that is given.
Result<std::unique_ptr<Input>> open_cache_input(const std::string& name, const std::string& mesh_path,
                                                const std::string& cache_path, const fs::path* folder,
                                                std::size_t least_frames) {
  Result<Mesh> mesh = read_mesh(mesh_path);
  if (!mesh) return mesh.error();
  Result<std::unique_ptr<PointCache>> opened = open_point_cache(cache_path);
  if (!opened) return opened.error();
  PointCache& cache = *opened.value();
  std::vector<std::string> notes = notes_on(mesh.value(), mesh_path);
  SceneDescription scene = describe(mesh.value());
  if (cache.point_count() != scene.vertex_count)
    return invalid_argument(cache_path + ": " + std::to_string(cache.point_count()) + " points, but " +
                            mesh_path + " has " + std::to_string(scene.vertex_count) + " vertices");
  if (cache.frame_count() < least_frames)
    return too_few_frames(cache_path, cache.frame_count(), least_frames);
  if (folder != nullptr)
    if (Status added = add_info(*folder, scene); !added) return added.error();
  if (scene.filters.near_at_rest > 0) {
    PositionBuffer first;
    if (Status read = cache.read(0, first); !read) return read.error();
    scene.filters.rest_at(view(first));
  }
  return std::unique_ptr<Input>(
      std::make_unique<CacheInput>(name, std::move(scene), std::move(opened).value(), std::move(notes)));
}

/// Whether a mesh without an info.json is a body, which can be replaced by another.
enum class WholeBody : bool { kUndeclared, kDeclared };

/// A frame each of `paths`; in the scene what info.json says in `folder`, if that is given.
Result<std::unique_ptr<Input>> open_mesh_files(std::span<const std::string> paths, const fs::path* folder,
                                               WholeBody whole) {
  Result<Mesh> first = read_listed_mesh(paths[0]);
  if (!first) return first.error();
  Faces listed;
  if (!first.value().polygons.empty()) listed = first.value().faces;
  if (const Status status = make_scene_mesh(first.value(), paths[0]); !status) return status.error();
  std::vector<std::string> notes = notes_on(first.value(), paths[0]);
  if (const auto note = numbers_out_of_order(paths)) notes.push_back(*note);
  SceneDescription scene = describe(first.value());
  if (whole == WholeBody::kDeclared) scene.bodies.push_back({"", 0, scene.vertex_count});
  if (folder != nullptr)
    if (Status added = add_info(*folder, scene); !added) return added.error();
  if (scene.filters.near_at_rest > 0) scene.filters.rest_at(view(first.value().positions));
  return std::unique_ptr<Input>(std::make_unique<MeshFilesInput>(
      paths[0], std::move(scene), std::vector<std::string>(paths.begin(), paths.end()), std::move(listed),
      std::move(first.value().positions), std::move(notes)));
}

// How to give mesh files of other names, if the folder has any.
std::string other_meshes_of(const fs::path& folder) {
  std::error_code failed;
  for (fs::directory_iterator file(folder, failed), end; !failed && file != end; file.increment(failed)) {
    if (is_mesh_file_name(file->path().string()))
      return "; mesh files of other names are given as files, in their order, as by $(ls -v " +
             (folder / "*").string() + file->path().extension().string() + ")";
  }
  return "";
}

}  // namespace

Result<std::unique_ptr<Input>> open_folder_input(const std::string& name, std::size_t least_frames) {
  const fs::path folder(name);
  std::error_code ignored;
  if (!is_there(folder)) return invalid_argument(name + ": no such file or folder");
  if (!fs::is_directory(folder, ignored))
    return invalid_argument(name + ": neither a folder nor a mesh file (.ply, .obj, .stl) by its name");
  if (is_there(folder / "mesh.ply")) {
    const fs::path mdd = folder / "frames.mdd", pc2 = folder / "frames.pc2";
    if (is_there(mdd) && is_there(pc2))
      return invalid_argument(name + ": holds both frames.pc2 and frames.mdd; keep the one that is meant");
    const fs::path& cache = is_there(mdd) ? mdd : pc2;
    return open_cache_input(folder.string(), (folder / "mesh.ply").string(), cache.string(), &folder,
                            least_frames);
  }
  std::vector<std::string> paths;
  for (;;) {
    const fs::path path = folder / std::string("t").append(std::to_string(paths.size())).append(".ply");
    if (!is_there(path)) break;
    paths.push_back(path.string());
  }
  if (paths.size() < least_frames)
    return invalid_argument(name + ": holds neither mesh.ply and frames.pc2 nor t0.ply" +
                            (least_frames > 1 ? " and t1.ply" : "") + other_meshes_of(folder));
  return open_mesh_files(paths, &folder, WholeBody::kUndeclared);
}

Result<std::unique_ptr<Input>> open_mesh_and_cache_input(const std::string& mesh, const std::string& cache,
                                                         std::size_t least_frames) {
  return open_cache_input(cache, mesh, cache, nullptr, least_frames);
}

Result<std::unique_ptr<Input>> open_npz_input(const std::string& path, std::size_t least_frames) {
  const Result<std::vector<NpzMember>> members = list_npz(path);
  if (!members) return members.error();
  std::optional<NpyArray> positions;
  SceneDescription scene;
  std::vector<std::string> notes;
  bool faces = false;
  for (const NpzMember& member : members.value()) {
    const std::string name = path + ": " + member.name;
    const bool known = member.name == "positions" || member.name == "faces" || member.name == "edges";
    if (!known) {
      notes.push_back(name + " is not looked at; positions, faces and edges are");
      continue;
    }
    Result<NpyArray> array = NpyArray::open(path, name, member.at, member.size);
    if (!array) return array.error();
    if (member.name == "positions") {
      if (Status status = check_frames(array.value().header(), name); !status) return status.error();
      positions.emplace(std::move(array).value());
    } else {
      const bool of_faces = member.name == "faces";
      faces |= of_faces;
      if (Status status =
              of_faces ? array.value().read_rows(scene.faces) : array.value().read_rows(scene.edges);
          !status)
        return status.error();
    }
  }
  if (!positions || !faces)
    return invalid_argument(
        path + ": holds no array '" + (positions ? "faces" : "positions") +
        "'; positions (frames, n, 3) and faces (m, 3) are expected, and perhaps edges (k, 2)");
  const NpyHeader& header = positions->header();
  if (header.shape[0] < least_frames)
    return too_few_frames(path + ": positions", header.shape[0], least_frames);
  if (header.shape[1] == 0)
    return invalid_argument(path + ": positions of no vertex; one or more are expected");
  scene.vertex_count = static_cast<std::uint32_t>(header.shape[1]);
  // Before notes_on() looks at them.
  const auto fits = [&scene](const auto& elements) {
    for (const auto& element : elements)
      for (const std::int32_t v : element)
        if (static_cast<std::uint32_t>(v) >= scene.vertex_count) return false;
    return true;
  };
  if (!fits(scene.faces) || !fits(scene.edges))
    return invalid_argument(path + ": " + (fits(scene.faces) ? "edges" : "faces") +
                            " name a vertex beyond the " + std::to_string(scene.vertex_count) +
                            " of positions");
  Mesh mesh{{}, scene.faces, {}, scene.edges};
  if (Status read = positions->read_frame(0, mesh.positions); !read) return read.error();
  for (std::string& note : notes_on(mesh, path)) notes.push_back(std::move(note));
  return std::unique_ptr<Input>(
      std::make_unique<NpzInput>(path, std::move(scene), std::move(*positions), std::move(notes)));
}

Result<std::unique_ptr<Input>> open_mesh_files_input(std::span<const std::string> paths,
                                                     std::size_t least_frames, TopologyChanges changes) {
  if (paths.size() < least_frames) return invalid_argument("a step needs two mesh files or more");
  if (changes != TopologyChanges::kAny) return open_mesh_files(paths, nullptr, WholeBody::kUndeclared);
  const std::size_t all = paths.size();
  std::unique_ptr<Input> first;
  Input* last = nullptr;
  while (!paths.empty()) {
    Result<std::size_t> alike = count_alike(paths);
    if (!alike) return alike.error();
    Result<std::unique_ptr<Input>> part =
        open_mesh_files(paths.first(alike.value()), nullptr,
                        alike.value() < all ? WholeBody::kDeclared : WholeBody::kUndeclared);
    if (!part) return part.error();
    Input* const here = part.value().get();
    if (last == nullptr)
      first = std::move(part).value();
    else
      last->set_next(std::move(part).value());
    last = here;
    paths = paths.subspan(alike.value());
  }
  if (frames_of_all_parts(*first) < least_frames)
    return invalid_argument(first->name() + ": all files have other topologies, so they are one moment");
  return first;
}

}  // namespace warmfront::client
