// SPDX-License-Identifier: Apache-2.0
// What many worlds in one scene take beside as many scenes, on one thread, and behind a daemon: prints a
// table, and passes no verdict.
//   worlds_bench [SCENE] [WORLDS...]   builtin:bart?triangles=1000, 1000 and 4096 by default
// Every world holds the scene at the same place, at a frame of its own of the scene's motion.
#include <stdlib.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "client/lib/client.h"
#include "client/scenes/catalog.h"
#include "engine/collider.h"
#include "server/daemon.h"
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
  return Collider::create(scene, std::span<const double>(positions), {}, std::make_shared<Workers>(1))
      .value();
}

/// In this process, with one thread; its limits are those that the scenes need.
class OneDaemon {
 public:
  OneDaemon() {
    std::string pattern = (std::filesystem::temp_directory_path() / "worlds_bench_XXXXXX").string();
    if (mkdtemp(pattern.data()) != nullptr) folder_ = pattern;
    server::Config config;
    config.listen = {address()};
    config.threads = 1;
    config.limits.max_vertices = config.limits.max_triangles = 100'000'000;
    config.limits.max_session_bytes = config.limits.max_total_bytes = std::size_t{16} << 30;
    daemon_ = server::Daemon::start(config, log_).value();
  }
  ~OneDaemon() {
    daemon_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  OneDaemon(const OneDaemon&) = delete;
  OneDaemon& operator=(const OneDaemon&) = delete;

  std::string address() const { return "unix:" + folder_ + "/d.sock"; }

 private:
  std::string folder_;
  std::ostringstream text_;
  server::Log log_{server::LogLevel::kWarning, server::LogFormat::kText, &text_};
  std::unique_ptr<server::Daemon> daemon_;
};

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

  const OneDaemon daemon;
  client::Client client = client::Client::connect(daemon.address()).value();
  const std::vector<double> start = all_at(0);
  client::Session remote =
      client.create_session(in_worlds(motion.scene, worlds), std::span<const double>(start)).value();
  const std::uint32_t few = std::min(worlds, 64U);
  std::vector<client::Session> sessions;
  for (std::uint32_t w = 0; w < few; ++w)
    sessions.push_back(client.create_session(motion.scene, std::span<const double>(frame_of(w, 0))).value());

  std::vector<double> of_remote;
  std::vector<double> of_sessions;
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
    const auto one =
        timed(ms, [&] { return together.step(std::span<const double>(all)).value().contacts.size(); });
    contacts_together += one;
    const auto there =
        timed(ms, [&] { return remote.step(Frame(std::span<const double>(all))).value().contacts.size(); });
    if (there != one) std::printf("%zu contacts where %zu are expected\n", there, one);
    timed(ms, [&] {
      for (std::uint32_t w = 0; w < few; ++w)
        sessions[w].step(Frame(std::span<const double>(frame_of(w, step)))).value();
      return 0;
    });
    if (step <= 3) continue;  // which build the front
    of_alone.push_back(ms[0]);
    of_together.push_back(ms[1]);
    of_remote.push_back(ms[2]);
    of_sessions.push_back(ms[3]);
  }
  std::size_t bytes = 0;
  for (const Collider& one : alone) bytes += one.memory_bytes();
  const auto us = [](const std::vector<double>& ms, std::uint32_t in) { return 1e3 * median(ms) / in; };
  std::printf(
      "%6u worlds, us a world: alone %.1f, together %.1f (%.2f); behind a daemon %.1f (%.1f more), a session "
      "each "
      "%.1f; %.0f frames a second; bytes %.2f of alone; contacts %llu and %llu\n",
      worlds, us(of_alone, worlds), us(of_together, worlds), median(of_together) / median(of_alone),
      us(of_remote, worlds), us(of_remote, worlds) - us(of_together, worlds), us(of_sessions, few),
      1e3 / median(of_remote), static_cast<double>(together.memory_bytes()) / static_cast<double>(bytes),
      static_cast<unsigned long long>(contacts_alone), static_cast<unsigned long long>(contacts_together));
  std::fflush(stdout);
}

}  // namespace
}  // namespace warmfront

int main(int count, char** arguments) {
  using namespace warmfront;  // NOLINT: a program of its own
  const auto spec =
      client::scenes::parse_scene_spec(count > 1 ? arguments[1] : "builtin:bart?triangles=1000");
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
