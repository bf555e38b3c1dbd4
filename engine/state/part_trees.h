// SPDX-License-Identifier: Apache-2.0
// The parts' hierarchies from step to step: which of them a step refits, which may wait, and which are
// arranged anew. Used by one thread at a time; steps run inside Workers::run().
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/broad_phase/apart_parts.h"
#include "engine/broad_phase/part_pair.h"
#include "engine/bvh/bvh.h"
#include "engine/bvh/kept_order.h"
#include "engine/bvh/refit.h"
#include "engine/state/core.h"

namespace warmfront {

/// Does a step keep what lasts for several: travel, and budgets?
inline bool is_lazy(const ColliderOptions& options) {
  return options.front == FrontMode::kWarm && options.lazy_front;
}

template <class Bounds>
class PartTrees {
 public:
  /// Begins a question, whose motion begins where the last one did (From::kStart) or ended. Of a trial, what
  /// nodes have travelled by its start is kept.
  void begin_step(From from, bool trial) {
    ++step_;
    from_ = from;
    trial_ = trial;
    if (from == From::kEnd) ++base_;
  }
  /// The last motion that a step began with is to be committed up to a fraction that is not 0; with `beside`,
  /// not quite along its lines: TrialWay.
  void shorten(const Core& core, double fraction, bool beside, Rounding rounding);
  /// It is not to be.
  void go_back();
  /// Bounds of the vertices alone, for a trial that goes part of the way of that motion and was not begun
  /// here.
  void bound_vertices(Core& core, StopSignal stop);
  /// After such trials: what moved in that motion gets all bounds anew in the next step.
  void forget_bounds_of_moved();
  /// Roots have half this separation (scene units), and the part's own thickness and arcs, on each side from
  /// the next refit on.
  void hold(double separation) { held_separation_ = separation; }
  /// Room for forget_bounds_of_moved() and forget_bounds() of a part, which throw nothing then.
  void make_room_to_forget() { unseen_.reserve(states_.size()); }
  /// After forget_bounds_of_moved(): the same of a part that a motion moved, or stopped, which no question
  /// looked at.
  void forget_bounds(PartId part) {
    if (number_of(part) >= unseen_.size()) return;  // no question has begun since it was added
    refit_in_[number_of(part)] = kNever;
    unseen_[number_of(part)] = kChanged;
  }
  /// Travel is that of where the next motion begins: what a trial added to it is taken back.
  void return_to_base();
  /// By part: does travel have what a trial from the last base added to it? Until the next call. After
  /// arrange_new().
  std::span<const std::uint8_t> off_base() noexcept;
  /// Parts without a hierarchy get one; with `rebuild` those that are tested against themselves, and were
  /// not, learn what shares vertices there. Returns how many are new. Throws Stopped when told to stop, and
  /// is good for clear() only then; the same holds for rearrange_loose(). What else takes a StopSignal throws
  /// it, too, and is good for forget_bounds() then.
  std::size_t arrange_new(const Core& core, bool rebuild, StopSignal stop);
  /// Gives parts that move and whose hierarchies had decayed by the last step new ones. Returns these parts,
  /// until the next call.
  std::span<const PartId> rearrange_loose(const Core& core, StopSignal stop);
  /// Takes the magnitude that this step's bounds are made with. Returns whether it is another one: then all
  /// bounds are made anew.
  bool take_magnitude(double magnitude);

  /// Begins the refits of a step: each part either waits, or is refit.
  void begin_refits() { refit_nodes_ = 0; }
  /// Computes the root alone of a part that waits until something comes near: one that is removed, one that
  /// only its pose is known of, or one that `apart` (which may be null) looks at and that is not tested
  /// against itself. Returns false for any other part: it is to be refit now. `rebuild`: the roots of what is
  /// stationary are computed, too. Thread-safe for different parts.
  bool wait(Core& core, PartId part, ApartParts* apart, bool rebuild);
  /// Begins and finishes the refit of a part; between them its subtrees are refit. Thread-safe for different
  /// parts.
  Refit<Bounds> begin_refit(Core& core, PartId part, StopSignal stop);
  void finish_refit(PartId part, const Refit<Bounds>& refit);
  /// The part's root is that of its hierarchy, which was refit. Of what is stationary the one stays by which
  /// others were found near it or not, unless `rebuild`: this one may be looser.
  void take_root(const Core& core, PartId part, bool rebuild) {
    if (trees_[number_of(part)].nodes.empty() || (states_[number_of(part)] == 0 && !rebuild)) return;
    roots_[number_of(part)] = thickened(trees_[number_of(part)].nodes[0], core.motion.vertices().frame(),
                                        held_separation(core, part));
  }
  /// After all parts were refit, or wait.
  void all_placed() { unseen_.clear(); }
  /// Those of `near` that wait, sorted; valid until the next call. They are to be refit now; their roots stay
  /// those by which they were found near: a hierarchy's may be looser, and then others would seem to be near
  /// that were not looked at.
  std::span<const PartId> waiting(std::span<const NearPair> near, StopSignal stop);
  /// After these were refit: what changed in parts that still wait is recomputed as a whole when it is
  /// needed.
  void leave_waiting();
  /// Measures hierarchies that are new in this step.
  void take_looseness();

  /// Of a part that is about to change: the hierarchy that it has, or would get in the next step; none where
  /// it has become so loose that another one is due.
  HeldOrder hierarchy_of(const Core& core, PartId part) const;
  /// A part is another one now: the next step gives it a hierarchy, which, if it is that of what is left, is
  /// as loose as it was when that was built. Numbers of what a part is made of begin elsewhere now.
  void forget(PartId part, bool keeps_hierarchy) noexcept;
  /// A part has changed locally: of the blocks of its hierarchy these hold something else, which the next
  /// step takes from the topology; other bounds hold, and those of vertices, which are where they were.
  /// Returns false, and does nothing, where that has no hierarchy to change, or much of it is another one.
  bool change(PartId part, std::vector<std::uint8_t>&& blocks) noexcept;
  /// Have parts changed so, which arrange_new() has taken? Then `take(part, blocks)` must be told of each.
  bool some_changed() const { return some_changed_; }
  template <class Take>
  void take_changed(Take&& take) {
    for (std::uint32_t p = 0; p < changed_.size(); ++p) {
      if (changed_[p].empty()) continue;
      take(PartId{p}, std::span<const std::uint8_t>(changed_[p]));
      changed_[p] = {};
    }
    some_changed_ = false;
  }
  void shift(PartId part, const NumberShift& by) noexcept {
    if (number_of(part) < trees_.size()) trees_[number_of(part)].shift(by);
  }

  /// All bounds are made anew in the next step.
  void forget_bounds();
  /// All hierarchies are arranged anew in the next step.
  void clear() {
    trees_.clear();
    for (std::vector<std::uint8_t>& blocks : changed_) blocks.clear();
    some_changed_ = false;
  }

  std::span<const Bvh<Bounds>> trees() const { return trees_; }  ///< by part
  /// By part: what holds it in this step, with the separation on each side.
  std::span<const Bounds> roots() const { return roots_; }
  std::span<const MotionState> states() const { return states_; }       ///< by part
  std::span<const std::int64_t> refit_in() const { return refit_in_; }  ///< by part: the step of its bounds
  std::int64_t step() const { return step_; }
  double magnitude() const { return magnitude_; }
  std::uint64_t refit_nodes() const { return refit_nodes_; }  ///< in this step
  std::size_t memory_bytes() const;

 private:
  // The step of bounds that are to be made anew as a whole.
  static constexpr std::int64_t kNever = -1;

  double held_separation(const Core& core, PartId part) const {
    double held = held_separation_;
    if (core.thickness.any()) held += 2 * core.thickness.of_part(part);
    return held + 2 * core.arcs.most_of(part);
  }
  void take_base(PartId part);
  void return_to_base(PartId part);
  MotionState unseen(PartId part) const {
    return number_of(part) < unseen_.size() ? unseen_[number_of(part)] : MotionState{0};
  }
  void bound_vertices(Core& core, PartId part, Known known, StopSignal stop);
  // Is the part's hierarchy not of this step?
  bool waits(PartId part) const { return refit_in_[number_of(part)] != step_; }

  std::vector<Bvh<Bounds>> trees_;
  bool some_forgotten_ = false;  // parts have no hierarchy, and need one
  // By part: blocks of its hierarchy that hold something else by now; empty where none do.
  std::vector<std::vector<std::uint8_t>> changed_;
  bool some_changed_ = false;
  std::vector<Bounds> roots_;
  std::vector<MotionState> states_;
  std::vector<std::int64_t> refit_in_;
  std::vector<MotionState> unseen_;        // by part: what changed in questions that did not begin here
  std::vector<PartId> late_;               // parts that waited
  std::vector<PartId> rearranged_;         // as rearrange_loose() returned
  // By part: the base whose travel its hierarchy keeps, and whether its own travel is another one.
  struct Base {
    std::int64_t of = kNever;
    bool left = true;
  };
  std::vector<Base> bases_;
  std::vector<std::uint8_t> off_base_;  // as off_base() returned
  double magnitude_ = 0;
  double held_separation_ = 0;
  std::int64_t step_ = 0;
  std::int64_t base_ = 0;  // where motions begin: one for all trials from there
  From from_ = From::kEnd;
  bool trial_ = false;
  std::atomic<std::uint64_t> refit_nodes_{0};
};

}  // namespace warmfront
