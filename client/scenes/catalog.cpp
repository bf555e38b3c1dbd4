// SPDX-License-Identifier: Apache-2.0
// The built-in scenes by name: see catalog.h.
#include "client/scenes/catalog.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr std::array<CatalogEntry, 11> kCatalog{{
    {"cloth-ball", "look-alike of UNC's cloth-ball: a cloth falls on a ball, which then spins", 92'000, 60,
     make_cloth_ball},
    {"flamenco", "look-alike of flamenco: three skirts round a twirling waist and kicking legs", 49'000, 60,
     make_flamenco},
    {"n-body", "look-alike of UNC's n-body: rigid balls knock together in a box", 34'000, 60, make_n_body},
    {"princess", "look-alike of princess: a dress and an overskirt on a body that turns to and fro", 40'000,
     60, make_princess},
    {"bart", "look-alike of BART: a door, a fan, an arm, bouncing balls and linked tori", 4'400, 70,
     make_bart},
    {"hair", "strands of edges, a hundred by default, on a head that turns to and fro", 12'000, 60,
     make_hair},
    {"particles", "points of a radius fall on a cloth that hangs from its corners", 20'000, 60,
     make_particles},
    {"ground", "a cloth falls over a ball that lies on the ground, a half-space", 20'000, 60, make_ground},
    {"torn", "a cloth on a ball is torn along its middle, and its halves are drawn off", 20'000, 70,
     make_torn},
    {"cut", "the same, but its topology changes as it is torn: for detect", 20'000, 70, make_cut},
    {"turning", "rigid rods turn fast among each other, along screws", 20'000, 60, make_turning},
}};

std::string names() {
  std::string list;
  for (const CatalogEntry& entry : kCatalog) list.append(list.empty() ? "" : ", ").append(entry.name);
  return list;
}

}  // namespace

std::span<const CatalogEntry> catalog() {
  return kCatalog;
}

Status set_parameter(SceneSpec& spec, std::string_view key, std::string_view value) {
  const bool triangles = key == "triangles";
  if (!triangles && key != "frames")
    return invalid_argument("no scene parameter '" + std::string(key) + "'; there are: triangles, frames");
  const std::uint32_t least = triangles ? kLeastTriangles : kLeastFrames;
  const std::uint32_t most = triangles ? kMostTriangles : kMostFrames;
  std::uint32_t number = 0;
  const auto [end, code] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (code != std::errc() || end != value.data() + value.size() || number < least || number > most)
    return invalid_argument("scene parameter " + std::string(key) + " must be a whole number in [" +
                            std::to_string(least) + ", " + std::to_string(most) + "], not '" +
                            std::string(value) + "'");
  (triangles ? spec.triangles : spec.frames) = number;
  return {};
}

Result<SceneSpec> parse_scene_spec(std::string_view text) {
  if (text.starts_with(kBuiltinPrefix)) text.remove_prefix(kBuiltinPrefix.size());
  const std::size_t question = text.find('?');
  const std::string_view name = text.substr(0, question);
  SceneSpec spec;
  for (const CatalogEntry& entry : kCatalog)
    if (entry.name == name) spec = {&entry, entry.triangles, entry.frames};
  if (!spec.entry)
    return invalid_argument("no built-in scene '" + std::string(name) + "'; there are: " + names());
  std::string_view rest = question == std::string_view::npos ? std::string_view() : text.substr(question + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos)
      return invalid_argument("scene parameter '" + std::string(pair) +
                              "' has no value; write triangles=N or frames=N");
    if (const Status status = set_parameter(spec, pair.substr(0, equals), pair.substr(equals + 1)); !status)
      return status.error();
  }
  return spec;
}

Animation::Animation(const SceneSpec& spec) : spec_(spec), model_(spec.entry->make(spec.triangles)) {}
Animation::~Animation() = default;

std::vector<std::uint32_t> Animation::changes() const {
  std::vector<std::uint32_t> frames = model_->changes();
  std::erase_if(frames, [this](std::uint32_t frame) { return frame + 1 >= spec_.frames; });
  return frames;
}

bool Animation::keeps_topology() const {
  return model_->changes().empty();
}

SceneDescription Animation::scene(std::size_t part) const {
  return model_->scene_of(part);
}

const std::vector<float>& Animation::frame(std::uint32_t index, std::size_t part) {
  if (index < current_) {
    model_ = spec_.entry->make(spec_.triangles);
    current_ = 0;
  }
  for (; current_ < index; ++current_) model_->advance();
  positions_.clear();
  positions_.reserve(3 * model_->positions().size());
  for (const Vec3& p : model_->positions_of(part))
    for (const double x : {p.x, p.y, p.z}) positions_.push_back(static_cast<float>(x));
  return positions_;
}

std::unique_ptr<Animation> make_animation(const SceneSpec& spec) {
  return std::make_unique<Animation>(spec);
}

}  // namespace warmfront::client::scenes
