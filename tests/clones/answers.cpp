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
#include <string>

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
  Way ways[] = {{"kdop18", {}}, {"aabb", {}},   {"near", {}}, {"exact", {}},
                {"fast", {}},   {"leaf-8", {}}, {"none", {}}};
  for (Way& way : ways) way.options.bounds = BoundsKind::kKDop18;
  ways[1].options.bounds = BoundsKind::kAabb;
  ways[2].options.min_separation = 0.02;
  ways[3].options.tier = Tier::kExact;
  ways[4].options.tier = Tier::kFast;
  ways[5].options.leaf_size = 8;
  ways[6].options.front = FrontMode::kNone;
  for (const scenes::CatalogEntry& entry : scenes::catalog())
    for (const Way& way : ways) print_steps({&entry, 2000, 12}, way);
}
