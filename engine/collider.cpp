// SPDX-License-Identifier: Apache-2.0
#include "engine/collider.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "engine/bounds/moving.h"
#include "engine/bounds/normal_cone.h"
#include "engine/bvh/bvh.h"
#include "engine/elementary/narrow_phase.h"
#include "engine/front/front.h"
#include "engine/motion/motion.h"
#include "engine/topology.h"

namespace warmfront {
namespace {

/// A lazy front looks for pairs to fold every this many steps: a pair that could be folded costs a compare a
/// step, looking whether it can costs a test.
constexpr std::int64_t kLazyPruneSteps = 8;

/// The hierarchy is rebuilt when its looseness has grown this much since its build.
constexpr double kLoosenessLimit = 2.0;

bool is_lazy(const ColliderOptions& options) {
  return options.front == FrontMode::kWarm && options.lazy_front;
}

class Stopwatch {
 public:
  /// Milliseconds since the last lap.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

Status check(const Positions& positions, std::uint32_t vertex_count) {
  return std::visit([&](auto values) { return check_positions(values, vertex_count); }, positions);
}

void copy_to(std::vector<double>& to, const Positions& positions) {
  std::visit([&](auto values) { to.assign(values.begin(), values.end()); }, positions);
}

std::vector<double> to_doubles(const Positions& positions) {
  std::vector<double> values;
  copy_to(values, positions);
  return values;
}

/// What does not depend on the kind of bounds.
struct Core {
  Core(std::shared_ptr<const Scene> the_scene, const Positions& positions, const ColliderOptions& the_options,
       std::shared_ptr<Workers> the_workers)
      : scene(std::move(the_scene)),
        options(the_options),
        workers(std::move(the_workers)),
        current(to_doubles(positions)),
        motion(current),
        shape(scene->face_count() + static_cast<std::uint32_t>(scene->isolated_vertices().size()),
              options.leaf_size) {
    // The cone theorem rules out meeting, not nearness.
    const bool cones = options.normal_cones && options.min_separation == 0;
    workers->run([&] { topology = std::make_unique<Topology>(*scene, motion, shape, cones); });
    vertex_bounds.resize(scene->vertex_count());
    patch_culled.resize(topology->patches.count());
  }

  std::shared_ptr<const Scene> scene;  // in the numbers first given; all below it is in those of topology
  ColliderOptions options;
  std::shared_ptr<Workers> workers;
  std::vector<double> current;  // positions at t = 1 of the last step, in the numbers first given
  std::vector<double> given;    // positions of the step in hand, likewise
  Motion motion;
  TreeShape shape;
  std::unique_ptr<const Topology> topology;
  std::vector<KDop18> vertex_bounds;
  std::vector<std::uint8_t> patch_culled;
  std::vector<Contact> contacts;
};

/// The pipeline, in the order of DESIGN section 2; one implementation for each kind of bounds.
class Pipeline {
 public:
  virtual ~Pipeline() = default;
  /// Tests the motion from core.current to core.given.
  virtual Result<StepResult> step(Core& core) = 0;
  virtual std::size_t memory_bytes() const = 0;
};

template <class Bounds>
class PipelineWith final : public Pipeline {
 public:
  Result<StepResult> step(Core& core) override {
    StepResult result;
    NarrowPhaseOutput output;
    try {
      core.workers->run([&] { output = run(core, result.statistics); });
    } catch (...) {  // out of memory: what was half done is not built upon
      bvh_ = {};
      front_.clear();
      throw;
    }
    if (output.over_limit) {
      front_.clear();  // its budgets count from positions that were never taken
      return Error{ErrorCode::kResourceExhausted,
                   "max_contacts: the step has more than " + std::to_string(core.options.max_contacts) +
                       " contacts; raise the limit, or ask for report \"count\" or \"earliest\""};
    }
    result.vf = output.vf;
    result.ee = output.ee;
    result.possible = output.possible;
    if (output.vf + output.ee > 0) result.earliest_toi = output.earliest;
    result.contacts = core.contacts;
    return result;
  }

  std::size_t memory_bytes() const override {
    return bvh_.memory_bytes() + front_.memory_bytes() + narrow_.memory_bytes();
  }

 private:
  NarrowPhaseOutput run(Core& core, StepStatistics& statistics) {
    Stopwatch total;
    Stopwatch stage;
    core.motion.set(core.current, core.given, core.topology->numbering.vertices());
    bound_vertices(core);
    const bool rebuilt = refit_or_build(core);
    cull_patches(core, statistics.counts);
    const NarrowPhaseInput input{
        core.topology->scene, core.topology->numbering, core.topology->ownership, core.topology->patches,
        core.patch_culled,    core.motion.vertices(),   core.vertex_bounds,       core.options};
    statistics.ms.refit = stage.lap();

    narrow_.begin(bvh_, input);
    statistics.front_state = advance_front(core.options, rebuilt);
    narrow_.flush();
    const double interleaved = stage.lap();
    const double elementary =
        std::min(interleaved, 1e3 * narrow_.elementary_seconds() / core.workers->threads());

    narrow_.test_orphans(core.topology->orphans);
    statistics.ms.adjacent = stage.lap();

    const NarrowPhaseOutput output = narrow_.finish(core.contacts);
    statistics.ms.front = interleaved - elementary;
    statistics.ms.elementary = elementary + stage.lap();
    add(statistics.counts, output.counts);
    statistics.counts.adjacent_pairs = core.topology->adjacent_pairs;
    statistics.counts.bv_tests = front_.counts().bv_tests;
    statistics.counts.front_skipped = front_.counts().skipped;
    statistics.counts.front_sprouted = front_.counts().sprouted;
    statistics.counts.front_pruned = front_.counts().pruned;
    statistics.counts.front_pairs = front_.size();
    statistics.counts.front_bytes = front_.pair_bytes();
    statistics.ms.total = total.lap();
    return output;
  }

  void bound_vertices(Core& core) {
    const auto vertices = core.motion.vertices();
    magnitude_ = motion_magnitude(vertices, core.motion.frame(), core.options.min_separation);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices.size(), 4096), [&](const auto& range) {
      moving_bounds(vertices.subspan(range.begin(), range.size()), core.motion.frame(),
                    core.options.min_separation, magnitude_, core.vertex_bounds.data() + range.begin());
    });
  }

  // Returns true when the hierarchy is another one than in the last step.
  bool refit_or_build(const Core& core) {
    if (bvh_.order.empty()) {
      bvh_.arrange(core.topology->scene, core.shape, core.topology->first_order, is_lazy(core.options));
    } else {
      refit(core.topology->scene, core.vertex_bounds, magnitude_, bvh_);
      if (!(looseness(bvh_) > kLoosenessLimit * bvh_.built_looseness)) return false;
      bvh_.arrange(core.topology->scene, core.shape,
                   build_order(core.topology->scene, core.motion, core.shape), is_lazy(core.options));
    }
    refit(core.topology->scene, core.vertex_bounds, magnitude_, bvh_);
    bvh_.built_looseness = looseness(bvh_);
    return true;
  }

  void cull_patches(Core& core, StepCounts& counts) {
    const Patches& patches = core.topology->patches;
    tbb::parallel_for(std::size_t{0}, patches.count(), [&](std::size_t p) {
      core.patch_culled[p] = provably_embedded(core.topology->scene, core.motion.vertices(), patches.faces[p],
                                               patches.contours[p]);
    });
    counts.cone_patches = static_cast<std::uint64_t>(std::ranges::count(core.patch_culled, 1));
  }

  // The front of this step: built, updated or rebuilt by the rules of its mode.
  FrontState advance_front(const ColliderOptions& options, bool new_hierarchy) {
    const bool keep = options.front != FrontMode::kNone;
    if (keep && !new_hierarchy && !front_.empty() && !due_for_rebuild(options)) {
      const std::size_t before = front_.size();
      ++steps_since_build_;
      const bool lazy = is_lazy(options);
      const bool prune =
          options.front == FrontMode::kWarm && (!lazy || steps_since_build_ % kLazyPruneSteps == 0);
      front_.update(bvh_, narrow_, {.prune = prune, .lazy = lazy}, options.max_front_bytes);
      stalled_steps_ = front_.size() > before ? 0 : stalled_steps_ + 1;
      return front_.overflowed() ? FrontState::kCapped : FrontState::kUpdated;
    }
    const bool first = steps_since_build_ < 0;
    front_.build(bvh_, narrow_, keep, options.max_front_bytes);
    steps_since_build_ = 0;
    stalled_steps_ = 0;
    if (!keep) return FrontState::kNone;
    if (front_.overflowed()) return FrontState::kCapped;
    return first ? FrontState::kBuilt : FrontState::kRebuilt;
  }

  // The paper's deferred rebuild (section 4.3), or every K steps (its section 8).
  bool due_for_rebuild(const ColliderOptions& options) const {
    if (options.front != FrontMode::kPaper) return false;
    const auto due = [](std::uint32_t limit, std::int64_t count) { return limit > 0 && count >= limit; };
    return due(options.rebuild_after_stalled_steps, stalled_steps_) ||
           due(options.rebuild_every_steps, steps_since_build_ + 1);
  }

  Bvh<Bounds> bvh_;
  double magnitude_ = 0;  // of the step's coordinates, local
  Front<Bounds> front_;
  NarrowPhase<Bounds> narrow_;
  std::int64_t steps_since_build_ = -1;
  std::int64_t stalled_steps_ = 0;
};

std::unique_ptr<Pipeline> make_pipeline(BoundsKind bounds) {
  if (bounds == BoundsKind::kAabb) return std::make_unique<PipelineWith<Aabb>>();
  return std::make_unique<PipelineWith<KDop18>>();
}

}  // namespace

struct Collider::Impl {
  Core core;
  std::unique_ptr<Pipeline> pipeline;
};

Collider::Collider(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Collider::~Collider() = default;
Collider::Collider(Collider&&) noexcept = default;
Collider& Collider::operator=(Collider&&) noexcept = default;

Result<Collider> Collider::create(std::shared_ptr<const Scene> scene, const Positions& positions,
                                  const ColliderOptions& options, std::shared_ptr<Workers> workers) {
  if (Status status = validate(options); !status) return status.error();
  if (Status status = check_hubs(*scene); !status) return status.error();
  if (Status status = check(positions, scene->vertex_count()); !status) return status.error();
  Core core(std::move(scene), positions, options, std::move(workers));
  return Collider(std::make_unique<Impl>(Impl{std::move(core), make_pipeline(options.bounds)}));
}

Result<StepResult> Collider::step(const Positions& positions) {
  Core& core = impl_->core;
  if (Status status = check(positions, core.scene->vertex_count()); !status) return status.error();
  copy_to(core.given, positions);
  Result<StepResult> result = impl_->pipeline->step(core);
  if (result.ok()) core.current.swap(core.given);
  return result;
}

const Scene& Collider::scene() const {
  return *impl_->core.scene;
}
const ColliderOptions& Collider::options() const {
  return impl_->core.options;
}
std::span<const double> Collider::positions() const {
  return impl_->core.current;
}

std::size_t Collider::memory_bytes() const {
  const Core& core = impl_->core;
  return core.scene->memory_bytes() + core.topology->memory_bytes() + core.motion.memory_bytes() +
         core.vertex_bounds.size() * sizeof(KDop18) +
         (core.current.capacity() + core.given.capacity()) * sizeof(double) +
         core.contacts.capacity() * sizeof(Contact) + impl_->pipeline->memory_bytes();
}

}  // namespace warmfront
