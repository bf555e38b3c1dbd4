// SPDX-License-Identifier: Apache-2.0
#include "engine/auto_bounds.h"

#include <algorithm>

namespace warmfront {
namespace {

template <std::size_t N>
double median(std::array<double, N> times) {
  std::ranges::nth_element(times, times.begin() + N / 2);
  return times[N / 2];
}

class AutoPipeline final : public Pipeline {
 public:
  Result<StepResult> step(Core& core, const Frame& frame, StopSignal stop) override {
    if (pipeline_->bounds() != trial_.bounds()) {  // now, since after a step was taken nothing may fail
      pipeline_ = make_pipeline(trial_.bounds());
      changed_ = true;
    }
    Result<StepResult> result = pipeline_->step(core, frame, stop);
    if (!result) return result;
    StepStatistics& statistics = result.value().statistics;
    if (changed_ && statistics.front_state == FrontState::kBuilt) {
      statistics.front_state = FrontState::kRebuilt;
      statistics.rebuild = Rebuild::kBounds;
    }
    trial_.take(statistics.ms);
    return result;
  }
  void parts_changed() override { pipeline_->parts_changed(); }
  BoundsKind bounds() const override { return trial_.bounds(); }
  Status self_check(const Core& core) override { return pipeline_->self_check(core); }
  void forget(Core& core) override { pipeline_->forget(core); }
  std::size_t memory_bytes() const override { return pipeline_->memory_bytes(); }

 private:
  BoundsTrial trial_;
  bool changed_ = false;
  std::unique_ptr<Pipeline> pipeline_ = make_pipeline(trial_.bounds());
};

}  // namespace

bool BoundsTrial::take(const StageTimes& ms) {
  if (decided_ || ++steps_ <= kSettling) return false;
  total_[steps_ - kSettling - 1] = ms.total;
  refit_[steps_ - kSettling - 1] = ms.refit;
  if (steps_ < kSettling + kCounted) return false;
  const double total = median(total_);
  if (bounds_ == BoundsKind::kKDop18) {
    kdop_ms_ = total;
    decided_ = median(refit_) <= kShare * total;
    return !decided_ && change_to(BoundsKind::kAabb);
  }
  decided_ = true;
  return total > kGain * kdop_ms_ && change_to(BoundsKind::kKDop18);
}

bool BoundsTrial::change_to(BoundsKind bounds) {
  bounds_ = bounds;
  steps_ = 0;
  return true;
}

std::unique_ptr<Pipeline> make_auto_pipeline() {
  return std::make_unique<AutoPipeline>();
}

}  // namespace warmfront
