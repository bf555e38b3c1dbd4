// SPDX-License-Identifier: Apache-2.0
#include "engine/pipeline.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>

#include "engine/apart_parts.h"
#include "engine/bounds/moving.h"
#include "engine/bounds/normal_cone.h"
#include "engine/bvh/bvh.h"
#include "engine/elementary/narrow_phase.h"
#include "engine/front/front.h"
#include "engine/front/near_parts.h"
#include "engine/self_check.h"

namespace warmfront {
namespace {

/// A lazy front looks for pairs to fold every this many steps: a pair that could be folded costs a compare a
/// step, looking whether it can costs a test.
constexpr std::int64_t kLazyPruneSteps = 8;

/// Vertices whose bounds are worth a task of their own.
constexpr std::uint32_t kGrain = 4096;

/// The step of bounds that are to be made anew as a whole.
constexpr std::int64_t kNever = -1;

/// A hierarchy is rebuilt when its looseness has grown this much since its build; looked at every few steps.
constexpr double kLoosenessLimit = 2.0;
constexpr std::int64_t kLoosenessSteps = 4;

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

template <class Bounds>
class PipelineWith final : public Pipeline {
 public:
  Result<StepResult> step(Core& core, const Frame& frame, StopSignal stop) override {
    StepResult result;
    NarrowPhaseOutput output;
    try {
      core.workers->run([&] { output = run(core, frame, stop, result.statistics); });
    } catch (const Stopped&) {
      take_back(core);
      return Error{ErrorCode::kCancelled, "the step was cancelled; the frame may be sent again"};
    } catch (...) {  // out of memory: what was half done is not built upon
      take_back(core);
      trees_.clear();
      throw;
    }
    if (output.over_limit) {
      take_back(core);
      return Error{ErrorCode::kResourceExhausted,
                   "max_contacts: the step has more than " + std::to_string(core.options.max_contacts) +
                       " contacts; raise the limit, or ask for report \"count\" or \"earliest\""};
    }
    result.vf = output.vf;
    result.ee = output.ee;
    result.possible = output.possible;
    if (output.vf + output.ee > 0) result.earliest_toi = output.earliest;
    result.contacts = core.contacts;
    result.geometry = core.geometry;
    return result;
  }

  void parts_changed() override { anew_ = true; }
  BoundsKind bounds() const override {
    return std::is_same_v<Bounds, Aabb> ? BoundsKind::kAabb : BoundsKind::kKDop18;
  }

  Status self_check(const Core& core) override {
    if (anew_ || trees_.empty()) return {};
    const bool front = core.options.front != FrontMode::kNone && !front_lost_;
    Status status;
    core.workers->run([&] {
      status =
          warmfront::self_check<Bounds>({core, trees_, roots_, refit_in_, steps_, near_pairs_, apart_.pairs(),
                                         front ? &front_ : nullptr, magnitude_, self_checks_++});
    });
    return status;
  }

  void forget(Core& core) override {
    forget_steps(core, Rebuild::kForgotten);
    trees_.clear();
    core.rigid_parts = {};
    core.rigid_parts.take_parts(core.model);
  }

  std::size_t memory_bytes() const override {
    std::size_t bytes = front_.memory_bytes() + narrow_.memory_bytes() + near_.memory_bytes() +
                        apart_.memory_bytes() + roots_.capacity() * sizeof(Bounds);
    for (const Bvh<Bounds>& tree : trees_) bytes += tree.memory_bytes();
    return bytes;
  }

 private:
  // The front's budgets and what it keeps count from positions that were never taken.
  void take_back(Core& core) {
    core.motion.undo();
    core.rigid_parts.undo();
    forget_steps(core, Rebuild::kInterrupted);
  }

  void forget_steps(Core& core, Rebuild why) {
    lost_to_ = why;
    front_.clear();
    front_lost_ = anew_ = true;
    std::ranges::fill(refit_in_, kNever);
    for (const auto& orphans : core.orphans) {
      if (orphans != nullptr) orphans->forget();
    }
  }

  NarrowPhaseOutput run(Core& core, const Frame& frame, StopSignal stop, StepStatistics& statistics) {
    Stopwatch total;
    Stopwatch stage;
    ++steps_;
    statistics.bounds = bounds();
    core.motion.begin(frame);
    core.rigid_parts.look(*core.topology, core.motion, core.model, core.options, core.workers, stop);
    const bool built = arrange_new(core);
    const bool rebuilt = rearrange_loose(core);
    cull_patches(core, statistics.counts);
    const NarrowPhaseInput input{core.topology->scene,
                                 core.topology->numbering,
                                 core.topology->ownership,
                                 core.topology->patches,
                                 core.patch_culled,
                                 core.motion.vertices().vertices(),
                                 core.motion.vertices().states(),
                                 core.vertex_bounds,
                                 core.options,
                                 stop};
    narrow_.begin(trees_, input);
    refit_placed(core, stop);
    statistics.counts.bv_tests = find_near(core, stop);
    refit_near(core, stop);
    take_looseness();
    double among_neighbours = 0;
    for (const double ms : neighbour_ms_) among_neighbours = std::max(among_neighbours, ms);
    statistics.ms.refit = stage.lap() - among_neighbours;

    statistics.front_state = advance_front(core.options, built || rebuilt, stop);
    statistics.rebuild = reason_of(statistics.front_state);
    narrow_.flush();
    const double interleaved = among_neighbours + stage.lap();
    const double elementary =
        std::min(interleaved, 1e3 * narrow_.elementary_seconds() / core.workers->threads());

    test_orphans(core);
    statistics.ms.adjacent = stage.lap();

    const NarrowPhaseOutput output = narrow_.finish(core.contacts);
    describe_contacts(core);
    statistics.ms.front = interleaved - elementary;
    statistics.ms.elementary = elementary + stage.lap();
    count(core, output, statistics.counts);
    statistics.ms.total = total.lap();
    return output;
  }

  // Parts without a hierarchy get one. Returns whether there were any.
  bool arrange_new(Core& core) {
    const auto& parts = core.topology->parts;
    refit_in_.resize(parts.size(), kNever);
    states_.resize(parts.size());
    roots_.resize(parts.size());
    if (anew_) {  // a part may be tested against itself that was not
      for (std::size_t p = 0; p < trees_.size(); ++p) {
        if (trees_[p].shared == nullptr && parts[p].shared != nullptr)
          trees_[p].shared = shared_vertices(core.topology->scene, trees_[p].shape, trees_[p].order);
      }
    }
    if (trees_.size() == parts.size()) return false;
    std::size_t first = trees_.size();
    trees_.resize(parts.size());
    tbb::parallel_for(first, parts.size(), [&](std::size_t p) {
      trees_[p].arrange(core.topology->scene, parts[p].shape, parts[p].order, parts[p].shared,
                        is_lazy(core.options));
    });
    std::fill(refit_in_.begin() + static_cast<std::ptrdiff_t>(first), refit_in_.end(), kNever);
    anew_ = true;
    return first == 0;
  }

  // Bounds of a part's vertices and hierarchy: of all, or of those that changed. The front tests neighbours
  // as subtrees are made.
  void refit_part(Core& core, std::uint32_t p, StopSignal stop) {
    const Motion& motion = core.motion.vertices();
    const FeatureRange& features = core.topology->parts[p].features;
    const RangeMotion& range = core.motion.range(p);
    const Known known = refit_in_[p] == kNever       ? Known::kNothing
                        : refit_in_[p] == steps_ - 1 ? Known::kLastStep
                                                     : Known::kOlder;
    refit_in_[p] = steps_;
    const auto bound = [&](std::size_t begin, std::size_t end) {
      point_bounds(motion.vertices().subspan(begin, end - begin), motion.states().subspan(begin, end - begin),
                   motion.frame(), core.options.min_separation, magnitude_, known,
                   core.vertex_bounds.data() + begin);
    };
    if (range.listed && known != Known::kNothing) {
      for (const std::uint32_t v : range.changed) bound(v, v + 1);
    } else if (features.end_vertex - features.first_vertex <= kGrain) {
      bound(features.first_vertex, features.end_vertex);
    } else {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(features.first_vertex, features.end_vertex, kGrain),
                        [&](const auto& vertices) { bound(vertices.begin(), vertices.end()); });
    }
    const auto test = [&](std::uint32_t subtree) {
      stop.check();
      Stopwatch watch;
      front_.test_subtree(p, subtree, narrow_.local());
      neighbour_ms_.local() += watch.lap();
    };
    const bool tests = tests_itself(core, p) && front_.lists_neighbours(p);
    const RefitInput input{
        core.topology->scene, core.vertex_bounds, motion.states(), range, magnitude_, known};
    // By reference, which a std::function holds without memory of its own.
    refit_nodes_ += tests ? refit(input, trees_[p], std::ref(test)) : refit(input, trees_[p]);
    states_[p] = trees_[p].states.empty() ? 0 : trees_[p].states[0];
    if (!trees_[p].nodes.empty()) roots_[p] = trees_[p].nodes[0];
  }

  // Is the part among those near itself? Such a part neither waits nor moves by poses.
  static bool tests_itself(const Core& core, std::uint32_t p) {
    return core.model.self_collision(p) && !core.rigid_parts.rigid(p);
  }

  // May the part's hierarchy wait until another part comes near? Its root tells when.
  bool may_wait(const Core& core, std::uint32_t p) const {
    return apart_.small(core.motion, p) && !tests_itself(core, p);
  }

  // Is the part's hierarchy not of this step?
  bool waits(std::uint32_t p) const { return refit_in_[p] != steps_; }

  // All parts but those that wait until something comes near: small ones, and those that only their poses are
  // known of.
  void refit_placed(Core& core, StopSignal stop) {
    refit_nodes_ = 0;
    for (double& ms : neighbour_ms_) ms = 0;
    separate_ = apart_.begin(core.motion, core.options);
    const double magnitude = core.motion.vertices().magnitude();
    if (magnitude != magnitude_) {  // bounds made before are with the smaller margin
      magnitude_ = magnitude;
      std::ranges::fill(refit_in_, kNever);
      anew_ = true;
    }
    tbb::parallel_for(std::uint32_t{0}, core.motion.part_count(), [&](std::uint32_t p) {
      if (core.model.is_removed(p)) {
        states_[p] = 0;
        roots_[p] = Bounds::empty();
        trees_[p] = {};
      } else if (separate_ && may_wait(core, p)) {
        states_[p] = core.motion.state(p);
        if (states_[p] == 0 && !anew_) return;
        roots_[p] =
            narrow<Bounds>(moving_bounds(apart_.points(core.motion, p), core.motion.vertices().frame(),
                                         core.options.min_separation, magnitude_));
      } else if (core.motion.unplaced(p)) {
        states_[p] = core.motion.state(p);
        const SceneMotion::Ball ball = core.motion.ball(p);
        roots_[p] = narrow<Bounds>(moving_bounds(ball.centre, ball.radius, core.motion.vertices().frame(),
                                                 core.options.min_separation, magnitude_));
      } else {
        refit_part(core, p, stop);
      }
    });
  }

  // Returns the tests that it took.
  std::uint64_t find_near(Core& core, StopSignal stop) {
    std::uint64_t bv_tests = 0;
    const auto near =
        near_.find(core.model, roots_, states_, anew_ || core.options.front == FrontMode::kNone, bv_tests);
    near_pairs_.clear();
    std::ranges::copy_if(near, std::back_inserter(near_pairs_), [&](const NearPair& pair) {
      return pair.parts.a != pair.parts.b || tests_itself(core, pair.parts.a);
    });
    if (separate_) apart_.sift(core.motion, core.options, anew_, stop, near_pairs_);
    anew_ = false;
    return bv_tests;
  }

  // Parts that waited, and have others near them.
  void refit_near(Core& core, StopSignal stop) {
    late_.clear();
    for (const NearPair& pair : near_pairs_) {
      for (const std::uint32_t p : {pair.parts.a, pair.parts.b}) {
        if (waits(p)) late_.push_back(p);
      }
    }
    std::ranges::sort(late_);
    late_.erase(std::unique(late_.begin(), late_.end()), late_.end());
    tbb::parallel_for(std::size_t{0}, late_.size(), [&](std::size_t i) {
      if (core.motion.unplaced(late_[i])) core.motion.place(late_[i]);
      refit_part(core, late_[i], stop);
    });
    // What changed unseen is made anew when it is needed.
    for (std::uint32_t p = 0; p < states_.size(); ++p) {
      if (waits(p) && states_[p] != 0) refit_in_[p] = kNever;
    }
  }

  // Gives a part that moves and whose hierarchy had decayed by the last step a new one. Returns whether there
  // was one.
  bool rearrange_loose(Core& core) {
    if (steps_ % kLoosenessSteps != 0) return false;
    bool rebuilt = false;
    for (std::uint32_t p = 0; p < trees_.size(); ++p) {
      Bvh<Bounds>& tree = trees_[p];
      const bool known = refit_in_[p] == steps_ - 1 && tree.built_looseness > 0;
      if (!known || core.model.is_removed(p) || (core.motion.state(p) & kMoving) == 0) continue;
      if (!(looseness(tree) > kLoosenessLimit * tree.built_looseness)) continue;  // or is not a number
      const Scene& scene = core.topology->scene;
      std::vector<Primitive> order = build_order(scene, core.motion.vertices(), tree.shape, tree.order);
      auto shared = tree.shared == nullptr ? nullptr : shared_vertices(scene, tree.shape, order);
      tree.arrange(scene, tree.shape, std::move(order), std::move(shared), is_lazy(core.options));
      refit_in_[p] = kNever;
      front_.forget(p);
      rebuilt = true;
    }
    return rebuilt;
  }

  // How loose hierarchies are that were made in this step.
  void take_looseness() {
    for (std::uint32_t p = 0; p < trees_.size(); ++p) {
      if (trees_[p].built_looseness == 0 && !trees_[p].nodes.empty() && !waits(p))
        trees_[p].built_looseness = looseness(trees_[p]);
    }
  }

  // Patches of parts that are tested against themselves; their vertices are where the step takes them.
  void cull_patches(Core& core, StepCounts& counts) {
    const Scene& scene = core.topology->scene;
    const Patches& patches = core.topology->patches;
    tbb::parallel_for(std::size_t{0}, patches.count(), [&](std::size_t p) {
      const std::uint32_t part = core.motion.part_of(scene.faces()[patches.faces[p].front()][0]);
      core.patch_culled[p] =
          tests_itself(core, part) &&
          provably_embedded(scene, core.motion.vertices().vertices(), patches.faces[p], patches.contours[p]);
    });
    counts.cone_patches = static_cast<std::uint64_t>(std::ranges::count(core.patch_culled, 1));
  }

  // What is found of leaves at rest serves again, unless later contacts were left out.
  static bool retest(const ColliderOptions& options) { return options.report == Report::kEarliest; }

  // The front of this step: built, updated or rebuilt by the rules of its mode.
  FrontState advance_front(const ColliderOptions& options, bool new_hierarchy, StopSignal stop) {
    const bool keep = options.front != FrontMode::kNone;
    const bool first = steps_since_build_ < 0;
    const bool update = keep && !front_lost_ && !due_for_rebuild(options);
    if (!update) front_.clear();
    const std::size_t before = front_.size();
    steps_since_build_ = update ? steps_since_build_ + 1 : 0;
    const bool lazy = is_lazy(options);
    const bool prune =
        options.front == FrontMode::kWarm && (!lazy || steps_since_build_ % kLazyPruneSteps == 0);
    front_.advance(trees_, near_pairs_, narrow_,
                   {.prune = prune,
                    .lazy = lazy,
                    .record = keep,
                    .retest = retest(options),
                    .max_bytes = options.max_front_bytes,
                    .stop = stop});
    front_lost_ = front_.overflowed();
    stalled_steps_ = !update || front_.size() > before ? 0 : stalled_steps_ + 1;
    if (!keep) return FrontState::kNone;
    if (front_.overflowed()) return FrontState::kCapped;
    if (first) return FrontState::kBuilt;
    return update && !new_hierarchy ? FrontState::kUpdated : FrontState::kRebuilt;
  }

  // What was lost stays so until a step was completed without it.
  Rebuild reason_of(FrontState state) {
    if (state == FrontState::kCapped) lost_to_ = Rebuild::kCapped;
    if (state != FrontState::kRebuilt) return Rebuild::kNone;
    const Rebuild lost = std::exchange(lost_to_, Rebuild::kNone);
    if (lost != Rebuild::kNone) return lost;
    return steps_since_build_ == 0 ? Rebuild::kPolicy : Rebuild::kDecayed;
  }

  // The paper's deferred rebuild (section 4.3), or every K steps (its section 8).
  bool due_for_rebuild(const ColliderOptions& options) const {
    if (options.front != FrontMode::kPaper) return false;
    const auto due = [](std::uint32_t limit, std::int64_t count) { return limit > 0 && count >= limit; };
    return due(options.rebuild_after_stalled_steps, stalled_steps_) ||
           due(options.rebuild_every_steps, steps_since_build_ + 1);
  }

  void test_orphans(Core& core) {
    std::vector<OrphanBlocks*> parts;
    for (std::uint32_t p = 0; p < core.orphans.size(); ++p) {
      if (core.orphans[p] == nullptr) continue;
      if (core.rigid_parts.rigid(p)) {
        core.orphans[p]->forget();
        continue;
      }
      core.orphans[p]->range = &core.motion.range(p);
      parts.push_back(core.orphans[p].get());
    }
    narrow_.test_orphans(parts, retest(core.options));
  }

  static void describe_contacts(Core& core) {
    core.geometry.clear();
    if (!core.options.fields.any()) return;
    core.geometry.resize(core.contacts.size());
    const std::span<const VertexMotion> vertices = core.motion.vertices().vertices();
    const std::span<const std::uint32_t> renumbered = core.topology->numbering.new_vertices();
    tbb::parallel_for(std::size_t{0}, core.contacts.size(), [&](std::size_t i) {
      const Contact& contact = core.contacts[i];
      std::array<const VertexMotion*, 4> four;
      const auto ids = core.scene->vertices_of(contact);
      for (int k = 0; k < 4; ++k) four[k] = &vertices[renumbered[ids[k]]];
      core.geometry[i] = contact_geometry(contact.kind, four, contact.toi);
    });
  }

  void count(const Core& core, const NarrowPhaseOutput& output, StepCounts& counts) const {
    add(counts, output.counts);
    counts.adjacent_pairs = core.topology->adjacent_pairs;
    counts.bv_tests += front_.counts().bv_tests;
    counts.front_skipped = front_.counts().skipped;
    counts.front_rested = front_.counts().rested;
    counts.front_sprouted = front_.counts().sprouted;
    counts.front_pruned = front_.counts().pruned;
    counts.front_pairs = front_.size();
    counts.front_bytes = front_.pair_bytes();
    counts.vertices_moved = core.motion.moved_vertices();
    counts.nodes_refit = refit_nodes_;
    counts.parts_moved = static_cast<std::uint64_t>(
        std::ranges::count_if(states_, [](MotionState state) { return (state & kMoving) != 0; }));
    counts.parts = core.model.part_count();
    counts.parts_rigid = core.rigid_parts.count();
    counts.near_parts = near_pairs_.size();
    counts.parts_apart = apart_.pairs().size();
    counts.part_pairs_excluded = core.excluded_pairs;
  }

  std::vector<Bvh<Bounds>> trees_;      // by part
  std::vector<Bounds> roots_;           // by part: what holds it in this step
  std::vector<std::uint8_t> states_;    // by part: MotionState
  std::vector<std::int64_t> refit_in_;  // by part: the step that its bounds are of
  std::vector<std::uint32_t> late_;     // parts whose hierarchies followed
  NearParts<Bounds> near_;
  std::vector<NearPair> near_pairs_;
  ApartParts apart_;
  bool separate_ = false;  // does it look at parts?
  std::uint64_t self_checks_ = 0;
  bool anew_ = true;      // nothing that is known of near parts holds
  double magnitude_ = 0;  // that bounds were made with
  Front<Bounds> front_;
  bool front_lost_ = true;
  Rebuild lost_to_ = Rebuild::kNone;
  NarrowPhase<Bounds> narrow_;
  std::atomic<std::uint64_t> refit_nodes_{0};
  tbb::enumerable_thread_specific<double> neighbour_ms_;  // taken by tests among neighbours in refit
  std::int64_t steps_ = 0;
  std::int64_t steps_since_build_ = -1;
  std::int64_t stalled_steps_ = 0;
};

}  // namespace

std::unique_ptr<Pipeline> make_pipeline(BoundsKind bounds) {
  if (bounds == BoundsKind::kAabb) return std::make_unique<PipelineWith<Aabb>>();
  return std::make_unique<PipelineWith<KDop18>>();
}

}  // namespace warmfront
