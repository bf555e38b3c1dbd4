// SPDX-License-Identifier: Apache-2.0
#include "engine/step/pipeline.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>

#include "engine/bounds/normal_cone.h"
#include "engine/broad_phase/apart_parts.h"
#include "engine/broad_phase/near_parts.h"
#include "engine/check/self_check.h"
#include "engine/elementary/contact_geometry.h"
#include "engine/front/front.h"
#include "engine/motion/trial_way.h"
#include "engine/narrow_phase/narrow_phase.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/held_bytes.h"
#include "engine/state/part_trees.h"
#include "engine/step/bodies_within.h"

namespace warmfront {
namespace {

/// A lazy front looks for pairs to fold every this many steps: a pair that could be folded costs a compare a
/// step, looking whether it can costs a test.
constexpr std::int64_t kLazyPruneSteps = 8;

/// Segments of the front for pairs of parts may take this share of its bytes, besides the pairs in them.
/// Where more parts are near each other than that, or than a block, bodies lie in one place by the thousands:
/// then their pairs are taken in blocks, none of which is kept.
constexpr std::size_t kSegmentsShare = 4;

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

Error too_many_contacts(const ColliderOptions& options) {
  return {ErrorCode::kResourceExhausted,
          "max_contacts: the step has more than " + std::to_string(options.max_contacts) +
              " contacts; raise the limit, or ask for report \"count\" or \"earliest\""};
}

template <class Bounds>
class PipelineWith final : public Pipeline {
 public:
  Result<StepResult> step(Core& core, const Frame& frame, Kind kind, StopSignal stop,
                          const AcceptStep& accept) override {
    StepResult result;
    Attempt attempt(*this, core);
    kind_ = kind;
    NarrowPhaseOutput output;
    try {
      const auto whole = [&] { output = run(core, attempt.motion, frame, stop, result.statistics); };
      core.workers->run(std::cref(whole));  // which a std::function holds without memory of its own
    } catch (const Stopped&) {
      attempt.hierarchies_hold = arranged_;
      return Error{ErrorCode::kCancelled, "the step was cancelled; the frame may be sent again"};
    } catch (const TooManyContacts&) {
      attempt.hierarchies_hold = arranged_;
      return too_many_contacts(core.options);
    }
    attempt.hierarchies_hold = true;
    if (output.over_limit) return too_many_contacts(core.options);
    result.vf = output.vf;
    result.ee = output.ee;
    result.possible = output.possible;
    result.overlaps_at_start = output.overlaps;
    if (output.vf + output.ee > 0) result.earliest_toi = output.earliest;
    result.contacts = core.contacts;
    result.geometry = core.geometry;
    if (accept)
      if (const Status accepted = accept(result); !accepted) return accepted.error();
    attempt.done(kind);
    if (!result.statistics.part_of_trial) {
      refind_ = false;
      longest_.until = core.options.report == Report::kEarliest ? result.earliest_toi.value_or(1) : 1;
    }
    return result;
  }

  void commit(Core& core, double fraction, Rounding rounding) noexcept override {
    core.motion.commit_trial(fraction, rounding == Rounding::kFloat32);
    const bool beside = longest_.shortened;
    const double of_longest = beside ? fraction * longest_.fraction : fraction;
    longest_.way.forget();
    if (of_longest < 1 || beside) trees_.shorten(of_longest, beside);
    if (of_longest > 0) front_.settle(trees_.trees());
    if (fraction == 1 && !beside) return;
    core.rigid_parts.lose_track();
    anew_ = true;  // rounding may put parts where no motion that was looked at goes
  }

  void options_changed(Core& core) override {
    refind_ = anew_ = true;
    core.rigid_parts.undo();
    for (const auto& orphans : core.orphans) {
      if (orphans != nullptr) orphans->forget();
    }
  }

  void bounds_widened(double more) override {
    longest_.way.forget();
    trees_.widen(more);
  }

  void parts_changed() override {
    longest_.way.forget();
    anew_ = true;
  }
  BoundsKind bounds() const override {
    return std::is_same_v<Bounds, Aabb> ? BoundsKind::kAabb : BoundsKind::kKDop18;
  }

  Status self_check(const Core& core, StopSignal stop) override {
    if (anew_ || longest_.shortened || trees_.trees().empty()) return {};
    const bool front = core.options.front != FrontMode::kNone && !front_lost_;
    Status status;
    core.workers->run([&] {
      status = warmfront::self_check<Bounds>(
          {core, trees_.trees(), trees_.roots(), trees_.refit_in(), trees_.step(), near_pairs_,
           apart_.pairs(), front ? &front_ : nullptr, trees_.magnitude(), self_checks_++, stop});
    });
    return status;
  }

  void forget(Core& core) override {
    RigidParts unmeasured;
    unmeasured.make_room(core.model);
    core.rigid_parts = std::move(unmeasured);
    forget_steps(core, Rebuild::kForgotten);
    trees_.clear();
  }

  std::size_t memory_bytes() const override {
    return sizeof(*this) + trees_.memory_bytes() + front_.memory_bytes() + narrow_.memory_bytes() +
           near_.memory_bytes() + apart_.memory_bytes() + held_bytes(near_pairs_, orphan_parts_) +
           longest_.way.memory_bytes();
  }

 private:
  /// A step that may fail, at whatever instruction: unless it is committed, the scene is left where it was,
  /// and nothing is kept that counts from positions that were never taken.
  struct Attempt {
    Attempt(PipelineWith& the_pipeline, Core& the_core)
        : motion(the_core.motion), pipeline(the_pipeline), core(the_core) {}
    ~Attempt() {
      if (committed) return;
      // Memory that grew with the step is given back, too.
      pipeline.narrow_.release();
      pipeline.near_ = {};
      std::vector<NearPair>().swap(pipeline.near_pairs_);
      pipeline.apart_ = {};
      std::vector<Contact>().swap(core.contacts);
      std::vector<ContactGeometry>().swap(core.geometry);
      core.rigid_parts.undo();
      pipeline.forget_steps(core, Rebuild::kInterrupted);
      if (!hierarchies_hold) pipeline.trees_.clear();  // what was half done is not built upon
    }
    Attempt(const Attempt&) = delete;
    Attempt& operator=(const Attempt&) = delete;

    void done(Kind kind) noexcept {
      kind == Kind::kStep ? motion.commit() : motion.keep();
      committed = true;
    }

    SceneMotion::Step motion;
    PipelineWith& pipeline;
    Core& core;
    bool hierarchies_hold = false;
    bool committed = false;
  };

  void forget_steps(Core& core, Rebuild why) noexcept {
    lost_to_ = why;
    longest_.way.forget();
    front_.clear();
    front_lost_ = anew_ = true;
    trees_.forget_bounds();
    for (const auto& orphans : core.orphans) {
      if (orphans != nullptr) orphans->forget();
    }
  }

  NarrowPhaseOutput run(Core& core, SceneMotion::Step& motion, const Frame& frame, StopSignal stop,
                        StepStatistics& statistics) {
    Stopwatch total;
    Stopwatch stage;
    arranged_ = false;
    statistics.bounds = bounds();
    motion.begin(frame, stop);
    if (goes_part_of_the_way(core, stop)) return run_shorter(core, stop, statistics);
    longest_.way.forget();
    if (std::exchange(longest_.shortened, false)) {
      trees_.forget_bounds_of_moved();
      anew_ = true;
    }
    trees_.begin_step(core.motion.from(), kind_ == Kind::kTrial);
    forget_outliers(core);
    core.rigid_parts.look(*core.topology, core.motion, core.model, core.options, core.workers, &bodies_within,
                          kind_ == Kind::kTrial, stop);
    const bool new_hierarchy = arrange(core, stop);
    arranged_ = true;
    cull_patches(core, stop, statistics.counts);
    const NarrowPhaseInput input = narrow_input(core, stop, kind_ == Kind::kTrial);
    narrow_.begin(trees_.trees(), input);
    double among_neighbours = refit_and_find_near(core, stop, statistics.counts.bv_tests);
    if (near_.overflowed()) {
      // With the front go the lists of neighbours, of which some have been tested: so all are, again.
      front_.clear();
      narrow_.begin(trees_.trees(), input);
      among_neighbours = 0;
    }
    statistics.ms.refit = stage.lap() - among_neighbours;

    statistics.front_state = near_.overflowed() ? traverse_in_blocks(core, stop, statistics.counts.bv_tests)
                                                : advance_front(core.options, new_hierarchy, stop);
    trees_.take_looseness();
    statistics.rebuild = reason_of(statistics.front_state);
    narrow_.flush();
    if (kind_ == Kind::kTrial) remember_way(core, stop);
    const double interleaved = among_neighbours + stage.lap();
    const double elementary =
        std::min(interleaved, 1e3 * narrow_.elementary_seconds() / core.workers->threads());

    test_orphans(core);
    statistics.ms.adjacent = stage.lap();

    const NarrowPhaseOutput output = narrow_.finish(core.contacts);
    describe_contacts(core, stop);
    statistics.ms.front = interleaved - elementary;
    statistics.ms.elementary = elementary + stage.lap();
    count(core, output, statistics.counts);
    statistics.ms.total = total.lap();
    return output;
  }

  // Is this a trial that goes part of the way of the longest one from the same start, whose bounds contain
  // its own? Then it can meet nothing that was not met there, as far as that one looked, and what was left
  // out there without a look need not be looked at, if that was left out for what is asked for now, too.
  bool goes_part_of_the_way(Core& core, StopSignal stop) {
    if (kind_ != Kind::kTrial || core.motion.from() != From::kStart || !longest_.way.known()) return false;
    const Motion& vertices = core.motion.vertices();
    if (vertices.magnitude() != trees_.magnitude() || !longest_.serves(core.options)) return false;
    for (std::uint32_t p = 0; p < core.motion.part_count(); ++p) {
      if (core.motion.unplaced(p) && (core.motion.state(p) & kMoving) != 0) core.motion.place(p, stop);
    }
    if (!all_move_as_a_whole(core)) return false;
    const std::optional<double> fraction = longest_.way.fraction_of(vertices, trees_.magnitude(), stop);
    if (!fraction || *fraction > longest_.until) return false;
    longest_.fraction = *fraction;
    longest_.shortened = true;
    return true;
  }

  // Are all vertices placed, and do none move one by one? Few that move cost little anyway.
  static bool all_move_as_a_whole(const Core& core) {
    for (std::uint32_t p = 0; p < core.motion.part_count(); ++p) {
      const bool moves = (core.motion.state(p) & kMoving) != 0;
      if (moves && (core.motion.unplaced(p) || core.motion.range(p).listed)) return false;
    }
    return true;
  }

  void remember_way(const Core& core, StopSignal stop) {
    if (!narrow_.knows_met() || !all_move_as_a_whole(core)) return;
    longest_.way.take(core.motion.vertices(), stop);
    longest_.asked = core.options;
    longest_.left_out = core.rigid_parts.count() > 0 || !apart_.pairs().empty();
    longest_.kept = narrow_.met_kept();
    longest_.until = 0;
  }

  // A trial that goes part of the way of the longest one: of that one the hierarchies, the front and all that
  // is known of parts stay.
  NarrowPhaseOutput run_shorter(Core& core, StopSignal stop, StepStatistics& statistics) {
    Stopwatch total;
    Stopwatch stage;
    arranged_ = true;
    statistics.bounds = bounds();
    statistics.part_of_trial = true;
    statistics.front_state =
        core.options.front == FrontMode::kNone ? FrontState::kNone : FrontState::kUpdated;
    trees_.bound_vertices(core, stop);
    cull_patches(core, stop, statistics.counts);
    const NarrowPhaseInput input = narrow_input(core, stop, false);
    narrow_.begin(trees_.trees(), input);
    statistics.ms.refit = stage.lap();
    narrow_.test_met();
    const double met = stage.lap();
    const double elementary = std::min(met, 1e3 * narrow_.elementary_seconds() / core.workers->threads());
    test_orphans(core);
    statistics.ms.adjacent = stage.lap();
    const NarrowPhaseOutput output = narrow_.finish(core.contacts);
    describe_contacts(core, stop);
    statistics.ms.front = met - elementary;
    statistics.ms.elementary = elementary + stage.lap();
    add(statistics.counts, output.counts);
    count_parts(core, statistics.counts);
    statistics.ms.total = total.lap();
    return output;
  }

  NarrowPhaseInput narrow_input(const Core& core, StopSignal stop, bool note_met) const {
    return {core.topology->scene,
            core.topology->numbering,
            core.topology->ownership,
            core.topology->patches,
            core.patch_culled,
            core.motion.vertices().vertices(),
            core.motion.vertices().states(),
            core.vertex_bounds,
            core.options,
            stop,
            gap_at(),
            note_met};
  }

  // Budgets hold what rounding could hide at the largest magnitude since they were granted. When that is
  // gone, bounds, budgets and travel begin again, as tight as the scene now allows.
  void forget_outliers(Core& core) {
    if (!(core.motion.vertices().magnitude() < trees_.magnitude())) return;
    forget_steps(core, Rebuild::kDecayed);
    trees_.clear();
  }

  // Parts without a hierarchy get one, and those whose has decayed another. Returns whether the step counts
  // as one that rebuilds: all are new, or some decayed.
  bool arrange(const Core& core, StopSignal stop) {
    const std::size_t arranged = trees_.arrange_new(core, anew_, stop);
    anew_ |= arranged > 0;
    const std::span<const std::uint32_t> rearranged = trees_.rearrange_loose(core, stop);
    for (const std::uint32_t part : rearranged) front_.forget(part);
    return (arranged > 0 && arranged == trees_.trees().size()) || !rearranged.empty();
  }

  // Brings hierarchies and the parts that are near each other to this step. Neighbours that the front lists
  // are tested by the tasks that refit them: returns the busiest thread's time with these, in ms.
  double refit_and_find_near(Core& core, StopSignal stop, std::uint64_t& bv_tests) {
    for (double& ms : neighbour_ms_) ms = 0;
    const auto test_neighbours = [&](std::uint32_t part, std::uint32_t subtree) {
      if (!core.tests_itself(part) || !front_.lists_neighbours(part)) return;
      stop.check();
      Stopwatch watch;
      front_.test_subtree(part, subtree, narrow_.local());
      neighbour_ms_.local() += watch.lap();
    };
    separate_ = apart_.begin(core.motion, core.options);
    anew_ |= trees_.take_magnitude(core.motion.vertices().magnitude());
    // By reference, which a std::function holds without memory of its own.
    trees_.refit_placed(core, separate_ ? &apart_ : nullptr, anew_, stop, std::cref(test_neighbours));
    bv_tests = find_near(core, stop);
    trees_.refit_near(core, near_pairs_, stop, std::cref(test_neighbours));
    double busiest = 0;
    for (const double ms : neighbour_ms_) busiest = std::max(busiest, ms);
    return busiest;
  }

  // Returns the tests that it took.
  std::uint64_t find_near(const Core& core, StopSignal stop) {
    std::uint64_t bv_tests = 0;
    const std::size_t most = std::max(NearParts<Bounds>::kBlock,
                                      core.options.max_front_bytes / kSegmentsShare / front_.kSegmentBytes);
    take_near(core, near_.find(core.model, trees_.roots(), trees_.states(),
                               anew_ || core.options.front == FrontMode::kNone, bv_tests, most, stop));
    near_count_ = 0;
    if (near_.overflowed()) {
      apart_.forget();
    } else {
      const double room = kind_ == Kind::kTrial ? kPairBesideTheWay * trees_.magnitude() : 0;
      if (separate_) apart_.sift(core.motion, core.options, room, anew_, stop, near_pairs_);
      near_count_ = near_pairs_.size();
    }
    anew_ = near_.overflowed();
    return bv_tests;
  }

  void take_near(const Core& core, std::span<const NearPair> near) {
    near_pairs_.clear();
    std::ranges::copy_if(near, std::back_inserter(near_pairs_), [&](const NearPair& pair) {
      return pair.parts.a != pair.parts.b || core.tests_itself(pair.parts.a);
    });
  }

  // All pairs of parts that are near each other, a block at a time, each from the root: the same answer
  // without a front.
  FrontState traverse_in_blocks(Core& core, StopSignal stop, std::uint64_t& bv_tests) {
    steps_since_build_ = stalled_steps_ = 0;
    front_lost_ = true;
    const auto no_neighbours = [](std::uint32_t, std::uint32_t) {};
    for (auto block = near_.next_block(core.model, trees_.states(), bv_tests, stop); !block.empty();
         block = near_.next_block(core.model, trees_.states(), bv_tests, stop)) {
      take_near(core, block);
      near_count_ += near_pairs_.size();
      trees_.refit_near(core, near_pairs_, stop, no_neighbours);
      front_.advance(trees_.trees(), near_pairs_, narrow_,
                     {.prune = false,
                      .record = false,
                      .retest = true,
                      .gap_at = gap_at(),
                      .max_bytes = 0,
                      .stop = stop});
      bv_tests += front_.counts().bv_tests;
    }
    near_pairs_.clear();
    return core.options.front == FrontMode::kNone ? FrontState::kNone : FrontState::kCapped;
  }

  // Patches of parts that are tested against themselves; their vertices are where the step takes them.
  void cull_patches(Core& core, StopSignal stop, StepCounts& counts) {
    const Scene& scene = core.topology->scene;
    const Patches& patches = core.topology->patches;
    constexpr std::size_t kAtOnce = 16;
    const auto cull = [&](std::size_t p) {
      const std::uint32_t part = core.motion.part_of(scene.faces()[patches.faces[p].front()][0]);
      core.patch_culled[p] =
          core.options.tier == Tier::kExact && core.options.min_separation == 0 &&
          reports_by_distance(core.options) && core.tests_itself(part) &&
          provably_embedded(scene, core.motion.vertices().vertices(), patches.faces[p], patches.contours[p]);
    };
    for_each_index(0, patches.count(), stop, cull, kAtOnce);
    counts.cone_patches = static_cast<std::uint64_t>(std::ranges::count(core.patch_culled, 1));
  }

  // Where the next motion begins, for which budgets are granted now.
  GapAt gap_at() const { return kind_ == Kind::kStep ? GapAt::kEnd : GapAt::kStart; }

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
    front_.advance(trees_.trees(), near_pairs_, narrow_,
                   {.prune = prune,
                    .lazy = lazy,
                    .record = keep,
                    .retest = retest(options),
                    .refind = refind_,
                    .gap_at = gap_at(),
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
    std::vector<OrphanBlocks*>& parts = orphan_parts_;
    parts.clear();
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

  static void describe_contacts(Core& core, StopSignal stop) {
    core.geometry.clear();
    if (!core.options.fields.any()) return;
    core.geometry.resize(core.contacts.size());
    const std::span<const VertexMotion> vertices = core.motion.vertices().vertices();
    const std::span<const std::uint32_t> renumbered = core.topology->numbering.new_vertices();
    for_each_index(0, core.contacts.size(), stop, [&](std::size_t i) {
      const Contact& contact = core.contacts[i];
      std::array<const VertexMotion*, 4> four;
      const auto ids = core.scene->vertices_of(contact);
      for (int k = 0; k < 4; ++k) four[k] = &vertices[renumbered[ids[k]]];
      core.geometry[i] = contact_geometry(contact.kind, four, contact.toi);
    });
  }

  void count(const Core& core, const NarrowPhaseOutput& output, StepCounts& counts) const {
    add(counts, output.counts);
    if (!near_.overflowed())
      counts.bv_tests += front_.counts().bv_tests;  // or they were added block by block
    counts.front_skipped = front_.counts().skipped;
    counts.front_rested = front_.counts().rested;
    counts.front_sprouted = front_.counts().sprouted;
    counts.front_pruned = front_.counts().pruned;
    counts.nodes_refit = trees_.refit_nodes();
    count_parts(core, counts);
  }

  void count_parts(const Core& core, StepCounts& counts) const {
    counts.adjacent_pairs = core.topology->adjacent_pairs;
    counts.front_pairs = front_.size();
    counts.front_bytes = front_.pair_bytes();
    counts.vertices_moved = core.motion.moved_vertices();
    counts.parts_moved = static_cast<std::uint64_t>(
        std::ranges::count_if(trees_.states(), [](MotionState state) { return (state & kMoving) != 0; }));
    counts.parts = core.model.part_count();
    counts.parts_rigid = core.rigid_parts.count();
    counts.near_parts = near_count_;
    counts.parts_apart = apart_.pairs().size();
    counts.part_pairs_excluded = core.excluded_pairs;
  }

  PartTrees<Bounds> trees_;
  NearParts<Bounds> near_;
  std::vector<NearPair> near_pairs_;
  std::vector<OrphanBlocks*> orphan_parts_;  // for test_orphans()
  std::uint64_t near_count_ = 0;             // in this step, in blocks or not
  ApartParts apart_;
  bool separate_ = false;  // does it look at parts?
  std::uint64_t self_checks_ = 0;
  bool arranged_ = false;  // in this step: its hierarchies are there
  bool anew_ = true;       // nothing that is known of near parts holds
  Front<Bounds> front_;
  bool front_lost_ = true;
  Kind kind_ = Kind::kStep;  // of the question in hand

  // The trial that hierarchies and front are of.
  struct LongestTrial {
    TrialWay way;            // known: others may go part of it
    ColliderOptions asked;   // that it was asked by
    bool left_out = false;   // pairs within parts, or of parts, without a look
    bool kept = false;       // it met what was found before it
    double until = 0;        // how far it looked
    bool shortened = false;  // the last question went part of its way,
    double fraction = 1;     // so much

    bool serves(const ColliderOptions& now) const {
      const bool same_reach = now.tier == asked.tier && now.tolerance == asked.tolerance &&
                              now.min_separation == asked.min_separation &&
                              reports_by_distance(now) == reports_by_distance(asked);
      const bool same_answer =
          same_reach && now.report == asked.report && now.leave_out_overlaps == asked.leave_out_overlaps;
      return (same_reach || !left_out) && (same_answer || !kept);
    }
  } longest_;
  bool refind_ = false;  // what was found of stationary parts was found by other options
  Rebuild lost_to_ = Rebuild::kNone;
  NarrowPhase<Bounds> narrow_;
  tbb::enumerable_thread_specific<double> neighbour_ms_;  // taken by tests among neighbours in refit
  std::int64_t steps_since_build_ = -1;
  std::int64_t stalled_steps_ = 0;
};

}  // namespace

std::unique_ptr<Pipeline> make_pipeline(BoundsKind bounds) {
  if (bounds == BoundsKind::kAabb) return std::make_unique<PipelineWith<Aabb>>();
  return std::make_unique<PipelineWith<KDop18>>();
}

}  // namespace warmfront
