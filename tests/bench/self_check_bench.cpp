// SPDX-License-Identifier: Apache-2.0
// What a self-check costs beside a warm step, on one thread: a cloth over a ball, the argument is its side in
// vertices. The share of all steps' time is their ratio over --self-check-steps.
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "engine/collider.h"
#include "tests/support/cloth_over_ball.h"

namespace warmfront {
namespace {

/// A cloth that was stepped until it is warm, and keeps oscillating.
class WarmCloth {
 public:
  explicit WarmCloth(int side) : cloth_(testing::cloth_over_ball(side, 12)) {
    for (std::size_t k = 1; k < cloth_.frames.size(); ++k) step();
  }

  std::size_t step() {
    at_ = at_ + 1 < 2 * cloth_.frames.size() - 2 ? at_ + 1 : 0;
    const std::size_t frame = at_ < cloth_.frames.size() ? at_ : 2 * cloth_.frames.size() - 2 - at_;
    return collider_.step(std::span<const double>(cloth_.frames[frame])).value().contacts.size();
  }
  bool check() { return collider_.self_check().ok(); }
  std::uint32_t triangles() const { return collider_.scene().face_count(); }

 private:
  testing::ClothOverBall cloth_;
  Collider collider_ =
      Collider::create(std::make_shared<const Scene>(Scene::create(cloth_.description).value()),
                       std::span<const double>(cloth_.frames.front()), {}, std::make_shared<Workers>(1))
          .value();
  std::size_t at_ = 0;
};

void warm_step(benchmark::State& state) {
  WarmCloth cloth(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(cloth.step());
  state.counters["triangles"] = cloth.triangles();
}
BENCHMARK(warm_step)->Arg(60)->Arg(160)->Unit(benchmark::kMillisecond);

void self_check(benchmark::State& state) {
  WarmCloth cloth(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    if (!cloth.check()) state.SkipWithError("the cloth is not sound");
  }
  state.counters["triangles"] = cloth.triangles();
}
BENCHMARK(self_check)->Arg(60)->Arg(160)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace warmfront
