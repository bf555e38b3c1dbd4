// SPDX-License-Identifier: Apache-2.0
#include "engine/step/auto_bounds.h"

#include <algorithm>

namespace warmfront {
namespace {

template <std::size_t N>
std::uint64_t median(std::array<std::uint64_t, N> counts) {
  std::ranges::nth_element(counts, counts.begin() + N / 2);
  return counts[N / 2];
}

class AutoPipeline final : public Pipeline {
 public:
  Result<StepResult> step(Core& core, const Frame& frame, Kind kind, StopSignal stop,
                          const AcceptStep& accept) override {
    if (pipeline_->bounds() != trial_.bounds()) {  // now, since after a step was taken nothing may fail
      pipeline_ = make_pipeline(trial_.bounds());
      changed_ = true;
    }
    Result<StepResult> result = pipeline_->step(core, frame, kind, stop, accept);
    if (!result) return result;
    StepStatistics& statistics = result.value().statistics;
    if (changed_ && statistics.front_state == FrontState::kBuilt) {
      statistics.front_state = FrontState::kRebuilt;
      statistics.rebuild = Rebuild::kBounds;
    }
    const bool comparable =
        core.options.report != Report::kEarliest && core.options.pair_test == PairTest::kMotion;
    if (comparable && !statistics.part_of_trial) trial_.take(statistics.counts);
    return result;
  }
  void commit(Core& core, double fraction, Rounding rounding) noexcept override {
    pipeline_->commit(core, fraction, rounding);
  }
  Status place(Core& core, const Frame& frame, StopSignal stop, const StepResult& result,
               const AcceptStep& accept) override {
    return pipeline_->place(core, frame, stop, result, accept);
  }
  void options_changed(Core& core) override { pipeline_->options_changed(core); }
  void parts_changed() override { pipeline_->parts_changed(); }
  HeldOrder hierarchy_of(const Core& core, PartId part) const override {
    return pipeline_->hierarchy_of(core, part);
  }
  void parts_replaced(Core& core, std::span<PartChange> changes) noexcept override {
    pipeline_->parts_replaced(core, changes);
  }
  void thickness_changed(Core& core) noexcept override { pipeline_->thickness_changed(core); }
  void poses_set(Core& core) noexcept override { pipeline_->poses_set(core); }
  void patches_changed(Core& core) noexcept override { pipeline_->patches_changed(core); }
  BoundsKind bounds() const override { return pipeline_->bounds(); }
  Status self_check(const Core& core, StopSignal stop) override { return pipeline_->self_check(core, stop); }
  void forget(Core& core) override { pipeline_->forget(core); }
  std::size_t memory_bytes() const override { return sizeof(*this) + pipeline_->memory_bytes(); }

 private:
  BoundsTrial trial_;
  bool changed_ = false;
  std::unique_ptr<Pipeline> pipeline_ = make_pipeline(trial_.bounds());
};

}  // namespace

bool BoundsTrial::take(const StepCounts& counts) {
  if (decided_ || counts.vertices_moved == 0 || ++steps_ <= kSettling) return false;
  const std::size_t counted = steps_ - kSettling;
  moved_[counted - 1] = counts.vertices_moved;
  tests_[counted - 1] = counts.primitive_tests + kPairWeight * counts.triangle_pairs;
  if (counted < kCounted) return false;
  const std::uint64_t moved = median(moved_);
  const std::uint64_t tests = median(tests_);
  if (bounds_ == BoundsKind::kKDop18) {
    kdop_tests_ = tests;
    decided_ = tests >= moved;
    return !decided_ && change_to(BoundsKind::kAabb);
  }
  decided_ = true;
  return tests > kdop_tests_ + moved / 2 && change_to(BoundsKind::kKDop18);
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
