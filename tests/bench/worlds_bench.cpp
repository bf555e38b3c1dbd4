// SPDX-License-Identifier: Apache-2.0
// What many worlds in one scene take beside as many scenes, on one thread: prints a table, and passes no verdict.
//   worlds_bench [SCENE] [WORLDS...]   builtin:bart?triangles=1000, 1000 and 4096 by default
// Every world holds the scene at the same place, at a frame of its own of the scene's motion.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "client/scenes/catalog.h"
#include "engine/collider.h"
#include "tests/bench/timing.h"

namespace warmfront {
namespace {

using testing::median;
using testing::timed;

struct Motion {
  SceneDescription scene;
  std::vector<std::vector<double>> frames;
};

Motion motion_of(const client::scenes::SceneSpec& spec) {
  const auto animation = client::scenes::make_animation(spec);
  Motion motion{animation->scene(), {}};
  for (std::uint32_t f = 0; f < spec.frames; ++f) {
    const std::vector<float>& frame = animation->frame(f);
    motion.frames.emplace_back(frame.begin(), frame.end());
  }
  return motion;
}

// The scene once for each world, one after the other.
SceneDescription in_worlds(const SceneDescription& one, std::uint32_t worlds) {
  SceneDescription all;
  const auto elements = [](const auto& from, std::uint32_t first, auto& to) {
    for (auto element : from) {
      for (auto& v : element) v += static_cast<std::int32_t>(first);
      to.push_back(element);
    }
  };
  for (std::uint32_t w = 0; w < worlds; ++w) {
    elements(one.faces, all.vertex_count, all.faces);
    elements(one.edges, all.vertex_count, all.edges);
    const auto first_body = static_cast<std::uint32_t>(all.bodies.size());
    for (Body body : one.bodies) {
      body.first_vertex += all.vertex_count;
      body.world = w + 1;
      all.bodies.push_back(body);
    }
    for (const auto& [a, b] : one.excluded_pairs)
      all.excluded_pairs.push_back({a + first_body, b + first_body});
    all.vertex_count += one.vertex_count;
  }
  return all;
}

Collider make(const SceneDescription& description, const std::vector<double>& positions) {
  auto scene = std::make_shared<const Scene>(Scene::create(description).value());
  return Collider::create(scene, std::span<const double>(positions), {}, std::make_shared<Workers>(1)).value();
}

void run(const Motion& motion, std::uint32_t worlds) {
  constexpr std::size_t kSteps = 12;
  const std::size_t frames = motion.frames.size();
  const auto frame_of = [&](std::uint32_t world, std::size_t step) -> const std::vector<double>& {
    return motion.frames[(7 * world) % (frames - kSteps) + step];
  };
  const auto all_at = [&](std::size_t step) {
    std::vector<double> all;
    for (std::uint32_t w = 0; w < worlds; ++w) {
      const std::vector<double>& one = frame_of(w, step);
      all.insert(all.end(), one.begin(), one.end());
    }
    return all;
  };
  std::vector<Collider> alone;
  for (std::uint32_t w = 0; w < worlds; ++w) alone.push_back(make(motion.scene, frame_of(w, 0)));
  Collider together = make(in_worlds(motion.scene, worlds), all_at(0));

  std::vector<double> of_alone;
  std::vector<double> of_together;
  std::uint64_t contacts_alone = 0;
  std::uint64_t contacts_together = 0;
  for (std::size_t step = 1; step <= kSteps; ++step) {
    const std::vector<double> all = all_at(step);
    std::vector<double> ms;
    const auto sweep = timed(ms, [&] {
      std::uint64_t contacts = 0;
      for (std::uint32_t w = 0; w < worlds; ++w)
        contacts += alone[w].step(std::span<const double>(frame_of(w, step))).value().contacts.size();
      return contacts;
    });
    contacts_alone += sweep;
    const auto one = timed(ms, [&] { return together.step(std::span<const double>(all)).value().contacts.size(); });
    contacts_together += one;
    if (step <= 3) continue;  // which build the front
    of_alone.push_back(ms[0]);
    of_together.push_back(ms[1]);
  }
  std::size_t bytes = 0;
  for (const Collider& one : alone) bytes += one.memory_bytes();
  std::printf("%6u worlds: alone %8.2f us a world, together %8.2f, ratio %.2f; bytes %.2f of alone; contacts %llu and %llu\n",
              worlds, 1e3 * median(of_alone) / worlds, 1e3 * median(of_together) / worlds,
              median(of_together) / median(of_alone),
              static_cast<double>(together.memory_bytes()) / static_cast<double>(bytes),
              static_cast<unsigned long long>(contacts_alone),
              static_cast<unsigned long long>(contacts_together));
  std::fflush(stdout);
}

}  // namespace
}  // namespace warmfront

int main(int count, char** arguments) {
  using namespace warmfront;  // NOLINT: a program of its own
  const auto spec = client::scenes::parse_scene_spec(count > 1 ? arguments[1] : "builtin:bart?triangles=1000");
  if (!spec) {
    std::fprintf(stderr, "%s\n", spec.error().message.c_str());
    return 2;
  }
  std::vector<std::uint32_t> worlds;
  for (int i = 2; i < count; ++i) worlds.push_back(static_cast<std::uint32_t>(std::atoi(arguments[i])));
  if (worlds.empty()) worlds = {1000, 4096};
  const Motion motion = motion_of(spec.value());
  std::printf("%u vertices, %zu bodies in each\n", motion.scene.vertex_count, motion.scene.bodies.size());
  for (const std::uint32_t n : worlds) run(motion, n);
}
