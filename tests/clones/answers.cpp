// SPDX-License-Identifier: Apache-2.0
// Prints the answers to the built-in scenes, several ways, in as many digits as there are: a line a step,
// with its contacts' hash and every count. Linked with kernels compiled for this instruction set or that.
#include <algorithm>
#include <array>
#include <bit>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "client/scenes/catalog.h"
#include "client/scenes/math.h"
#include "engine/collider.h"
#include "engine/contact_hash.h"
#include "engine/workers.h"

namespace {

using namespace warmfront;
namespace scenes = warmfront::client::scenes;

template <class T>
T must(Result<T> result) {
  if (result) return std::move(result).value();
  std::fprintf(stderr, "answers: %s\n", result.error().message.c_str());
  std::exit(2);
}

struct Way {
  const char* name;
  ColliderOptions options;
};

/// What moves along a screw turns about the middle of its vertices, each body faster than the one before it.
std::vector<BodyPose> turned(const Scene& scene, std::span<const float> start, std::uint32_t frame) {
  std::vector<BodyPose> poses;
  for (std::uint32_t b = 0; b < scene.bodies().size(); ++b) {
    const Body& body = scene.bodies()[b];
    if (!body.screw) continue;
    scenes::Vec3 middle;
    for (std::uint32_t v = body.first_vertex; v < body.first_vertex + body.vertex_count; ++v)
      middle += scenes::Vec3{start[3 * v], start[3 * v + 1], start[3 * v + 2]};
    middle = (1.0 / body.vertex_count) * middle;
    const scenes::Pose turn = scenes::turned({1, 0, 0}, frame * (0.1 + 0.2 * (b % 8)), {});
    const scenes::Vec3 shift = middle - turn.rotate(middle);
    Pose pose;
    for (std::size_t row = 0; row < 3; ++row) {
      const scenes::Vec3& r = turn.rows[row];
      std::copy_n(std::array{r.x, r.y, r.z,
                             row == 0   ? shift.x
                             : row == 1 ? shift.y
                                        : shift.z}
                      .begin(),
                  4, pose.matrix.begin() + static_cast<std::ptrdiff_t>(4 * row));
    }
    poses.push_back({b, pose});
  }
  return poses;
}

void print_steps(const scenes::SceneSpec& spec, const Way& way) {
  const std::unique_ptr<scenes::Animation> animation = scenes::make_animation(spec);
  const auto scene = std::make_shared<const Scene>(must(Scene::create(animation->scene())));
  auto collider = must(Collider::create(scene, std::span<const float>(animation->frame(0)), way.options,
                                        std::make_shared<Workers>(1)));
  for (std::uint32_t f = 1; f < spec.frames; ++f) {
    const std::vector<BodyPose> poses = turned(*scene, animation->frame(0), f);
    Frame frame;
    if (poses.empty())
      frame = Frame(std::span<const float>(animation->frame(f)));
    else
      frame.poses = poses;
    const StepResult result = must(collider.step(frame));
    ContactHash hash;
    hash.add_step(*scene, result.contacts);
    std::printf("%s %s %u %s", std::string(spec.entry->name).c_str(), way.name, f, hash.hex().c_str());
    static_assert(std::has_unique_object_representations_v<StepCounts>);
    using Numbers = std::array<std::uint64_t, sizeof(StepCounts) / sizeof(std::uint64_t)>;
    for (const std::uint64_t number : std::bit_cast<Numbers>(result.statistics.counts))
      std::printf(" %" PRIu64, number);
    std::printf("\n");
  }
}

}  // namespace

int main() {
  Way ways[] = {{"kdop18", {}},
                {"aabb", {.bounds = BoundsKind::kAabb}},
                {"near", {.min_separation = 0.02}},
                {"exact", {.tier = Tier::kExact}},
                {"fast", {.tier = Tier::kFast}},
                {"leaf-8", {.leaf_size = 8}},
                {"none", {.front = FrontMode::kNone}}};
  // Not `auto`, which would change bounds in the middle.
  for (Way& way : ways)
    if (way.options.bounds == BoundsKind::kAuto) way.options.bounds = BoundsKind::kKDop18;
  for (const scenes::CatalogEntry& entry : scenes::catalog())
    for (const Way& way : ways) {
      const scenes::SceneSpec spec{&entry, 1000, 12};
      const Scene scene = must(Scene::create(scenes::make_animation(spec)->scene()));
      const bool thick = scene.most_thickness() > 0;
      const bool turns = screw_count(scene.bodies()) > 0;
      if ((thick && way.options.tier == Tier::kFast) || (turns && way.options.tier == Tier::kExact)) continue;
      print_steps(spec, way);
    }
}
