// SPDX-License-Identifier: Apache-2.0
// steps_in_cpp FILE ROUNDS THREADS: the steps of the file through Collider; prints of each round the seconds,
// then the rows told.
#include <cstdlib>
#include <memory>
#include <span>
#include <string>

#include "engine/collider.h"
#include "tests/bench/in_process_steps.h"

int main(int count, char** arguments) {
  using namespace warmfront;
  if (count != 4) return 3;
  const steps all = read_steps(arguments[1]);
  const std::size_t numbers = std::size_t{3} * all.vertices;
  const auto frame = [&](std::uint32_t k) {
    return std::span<const float>(all.positions + numbers * k, numbers);
  };
  const auto workers = std::make_shared<Workers>(std::atoi(arguments[3]));
  unsigned long long told = 0;
  for (int round = 0; round < std::atoi(arguments[2]); ++round) {
    SceneDescription scene;
    scene.vertex_count = all.vertices;
    for (std::size_t f = 0; f < all.faces; ++f)
      scene.faces.push_back({all.indices[3 * f], all.indices[3 * f + 1], all.indices[3 * f + 2]});
    Result<Scene> made = Scene::create(std::move(scene));
    if (!made) return 2;
    Result<Collider> collider =
        Collider::create(std::make_shared<const Scene>(std::move(made).value()), frame(0), {}, workers);
    if (!collider) return 2;
    const double begin = seconds();
    for (std::uint32_t k = 1; k < all.frames; ++k) {
      const Result<StepResult> step = collider.value().step(frame(k));
      if (!step) return 2;
      told += step.value().contacts.size();
    }
    std::printf("%.9f\n", seconds() - begin);
  }
  std::printf("%llu\n", told);
}
