// SPDX-License-Identifier: Apache-2.0
// Prints the answers to the built-in scenes, several ways, in as many digits as there are: a line a step,
// with its contacts' hash and every count. Linked with kernels compiled for this instruction set or that.
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

#include "client/scenes/catalog.h"
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

void print_steps(const scenes::SceneSpec& spec, const Way& way) {
  const std::unique_ptr<scenes::Animation> animation = scenes::make_animation(spec);
  const auto scene = std::make_shared<const Scene>(must(Scene::create(animation->scene())));
  auto collider = must(Collider::create(scene, std::span<const float>(animation->frame(0)), way.options,
                                        std::make_shared<Workers>(1)));
  for (std::uint32_t f = 1; f < spec.frames; ++f) {
    const StepResult result = must(collider.step(Frame(std::span<const float>(animation->frame(f)))));
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
      const scenes::SceneSpec spec{&entry, 2000, 12};
      const bool thick = must(Scene::create(scenes::make_animation(spec)->scene())).most_thickness() > 0;
      if (!thick || way.options.tier != Tier::kFast) print_steps(spec, way);
    }
}
