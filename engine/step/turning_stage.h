// SPDX-License-Identifier: Apache-2.0
// The stage that tests parts against each other that turn by much: of an arc its line says little then, so
// the motion is looked at in pieces. It keeps nothing from step to step but its memory. Used by one thread at
// a time, inside Workers::run().
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/broad_phase/part_pair.h"
#include "engine/bvh/bvh.h"
#include "engine/narrow_phase/narrow_phase.h"
#include "engine/narrow_phase/pair_tester.h"
#include "engine/state/core.h"
#include "engine/step/chord_boxes.h"
#include "engine/step/kept_room.h"
#include "engine/stop.h"

namespace warmfront {

/// A part's motion is cut into pieces of equal time, 2 to 32 of them, by the largest angle of any. In each a
/// box about a node holds the chords of its vertices; where the boxes of two primitives are, in each piece,
/// farther apart than the separation, the arcs' distance from their chords and what the elementary test
/// allows itself (certified_reach()), that test reports nothing of them: it looks at the same chords, or
/// shorter ones within. Two primitives are tested once, in the first piece in which their boxes are nearer;
/// of two faces those features whose own 18-DOPs are nearer in some piece.
///
/// Where distances are kept, how far apart boxes must be goes by where they are at the start (kept_room.h).
/// Of an earliest question no piece is looked at that begins after what was found, neither of all nor of two
/// faces: what is first near in a piece is reported no earlier than there.
class TurningStage {
 public:
  /// Takes the near pairs of parts that are this stage's out of those that are the front's. Where an arc is
  /// no longer than a share of its part, the front serves.
  void take(const Core& core, std::span<const NearPair> near, StopSignal stop);
  /// The others, sorted.
  std::span<const NearPair> others(std::span<const NearPair> near) const {
    return pairs_.empty() ? near : std::span<const NearPair>(others_);
  }
  std::span<const NearPair> pairs() const { return pairs_; }  ///< sorted
  void forget() noexcept {
    pairs_.clear();
    others_.clear();
  }

  /// Tests them, and tells `narrow`; all parts of theirs are placed, with bounds of their vertices. Parallel.
  /// Returns the number of tests of boxes. Throws Stopped when told to stop, and TooManyContacts.
  template <class Bounds>
  std::uint64_t run(const Core& core, std::span<const Bvh<Bounds>> trees, NarrowPhase<Bounds>& narrow,
                    StopSignal stop);

  std::size_t memory_bytes() const;

 private:
  using Box = ChordBox;
  static constexpr int kMostPiecesOfStep = 32;
  /// The positions that are held take no more than this share of max_front_bytes: others are computed anew,
  /// to the same bits, each time that they are asked for.
  static constexpr std::size_t kPositionsShare = 4;
  /// Sums of larger coordinates may overflow: of these nothing is told.
  static constexpr double kMostReach = 0x1p1000;
  /// Of a part's hierarchy.
  struct Boxes {
    std::vector<Box> nodes;
    std::vector<Box> blocks;      ///< of leaves
    std::vector<Box> primitives;  ///< by place in the hierarchy's order
  };
  /// A part that is in a pair.
  struct Part {
    PartId part;
    bool rests = false;                     ///< its boxes are those of every piece
    bool bounded = false;                   ///< its boxes are those of some piece
    bool near = false;                      ///< it is near another one in the piece in hand
    bool holds = false;                     ///< its positions: there is room for them
    std::vector<Corner> at;                 ///< these, by time and vertex, of one that turns
    std::vector<Box> at_times;              ///< by time: of all vertices
    Box ever;                               ///< around these
    std::vector<std::array<std::uint32_t, 3>> corners;  ///< of the primitives, among the part's vertices
    std::vector<Box> vertices;                          ///< of the piece in hand
    Boxes now;                                          ///< the same
    Boxes start;                                        ///< where distances are kept
    double size = 0;                        ///< no two coordinates of its vertices, ever, are farther apart
    double away = 0;                        ///< of a point of an arc from its chord in one piece
    double reach = 0;                       ///< no coordinate is larger in magnitude
  };

  /// Two parts that come near each other, by all pieces together.
  struct MetPair {
    std::uint32_t a;  ///< index in parts_
    std::uint32_t b;
    KeptRoom room;  ///< between boxes
  };

  void take_met(const Core& core, StopSignal stop);
  void share_room(const Core& core);
  void place(const Core& core, Part& part, StopSignal stop) const;
  /// Of a vertex, by its number in the part.
  Corner position(const Core& core, const Part& part, std::uint32_t v, int time) const;
  Box box_of(const Core& core, const Part& part, const std::array<std::uint32_t, 3>& corners,
             int piece) const;
  std::uint32_t near_features_of(const Core& core, const Part& f, std::uint32_t place_f, const Part& g,
                                 std::uint32_t place_g, int piece, double latest, double room) const;
  double room_of(const Core& core, const Part& f, std::uint32_t place_f, const Part& g, std::uint32_t place_g,
                 const KeptRoom& room) const;
  template <class Bounds>
  void bound(const Core& core, const Bvh<Bounds>& tree, Part& part, int piece, StopSignal stop) const;
  template <class Bounds>
  std::uint64_t traverse(const Core& core, std::span<const Bvh<Bounds>> trees, const MetPair& pair, int piece,
                         PairTester& tester, StopSignal stop) const;
  KeptRoom room_between(const Core& core, const Part& a, const Part& b) const;
  // Those of blocks and nodes, around those of primitives.
  static void bound_above(const TreeShape& shape, Boxes& boxes, StopSignal stop);
  bool are_near(const MetPair& pair, int piece) const;
  double time_of(std::size_t k) const { return static_cast<double>(k) / pieces_; }

  std::vector<NearPair> pairs_;
  std::vector<NearPair> others_;
  std::vector<MetPair> met_;
  std::vector<PartId> named_;
  std::vector<Part> parts_;  // of these pairs, by number; then some that were
  std::size_t part_count_ = 0;
  int pieces_ = 0;
};

}  // namespace warmfront
