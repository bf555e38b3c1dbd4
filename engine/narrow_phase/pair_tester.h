// SPDX-License-Identifier: Apache-2.0
// One thread's path from triangle pairs to contacts. Used by one thread at a time; `Shared` by all of them.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/bounds/overlap.h"
#include "engine/elementary/elementary_test.h"
#include "engine/elementary/half_space.h"
#include "engine/elementary/query.h"
#include "engine/elementary/turning.h"
#include "engine/elementary/verdict.h"
#include "engine/front/rest_answer.h"
#include "engine/narrow_phase/contact_list.h"
#include "engine/narrow_phase/earliest_times.h"
#include "engine/narrow_phase/feature_block.h"
#include "engine/narrow_phase/met_pairs.h"
#include "engine/narrow_phase/narrow_phase.h"
#include "engine/narrow_phase/room_pairs.h"
#include "engine/narrow_phase/triangle_filter.h"
#include "engine/parallel/stage_clock.h"

namespace warmfront {

/// Data that the threads of a step share besides the constant input.
struct NarrowPhaseShared {
  EarliestTimes earliest;                ///< prunes for Report::kEarliest
  std::atomic<std::size_t> contacts{0};  ///< contacts kept by all threads
};

class PairTester {
 public:
  /// Starts a step; buffers are kept.
  void begin(const NarrowPhaseInput& input, NarrowPhaseShared& shared);

  /// Two primitives whose moving bounds overlap and that share no vertex. `near`: of two faces, the lesser
  /// first, the pairs of features that may meet, bits as Ownership::candidates() has them.
  void primitive_pair(Primitive p, Primitive q, std::uint32_t near = ~0U);
  /// The same, where their bounds may be apart.
  void met_pair(Primitive p, Primitive q);

  /// Elementary tests of the orphan sets; ids as in Orphans.
  void orphan(VertexFaceIds ids);
  void orphan(EdgeEdgeIds ids);
  void orphan(EdgeFaceIds ids);

  /// A vertex, in new numbers, that moves so, and a half-space that it may meet, a body that is so thick.
  void vertex_half_space(std::uint32_t v, const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                         std::uint32_t body, double thickness);

  /// The leaves looked at next are of these parts.
  void begin_leaves(PartId part_a, PartId part_b) {
    world_ = input_->worlds.place(body_of_part(part_a), body_of_part(part_b));
    turning_ = input_->arcs.any() &&
               (input_->arcs.of_part(part_a) != nullptr || input_->arcs.of_part(part_b) != nullptr);
  }
  /// Their contacts after this time are not needed (Report::kEarliest); rounded up, 1 or more if all are. On
  /// arcs they all are: their times may be earlier than those of their lines' bounds, by the tolerance.
  float until() const { return asks_for_earliest() && !turning_ ? until_in(world_) : 1; }

  /// The same, as their contacts tell it, whatever they move along.
  double earliest() const { return asks_for_earliest() ? shared_->earliest.of(world_) : 1; }

  /// Tests all pairs taken so far.
  void flush();
  /// The same in pieces, by other threads' testers: what flush() would test, until drop_pending().
  std::span<const FeaturePair> pending() {
    filter_elements();
    return {block_.pairs.data(), block_.size};
  }
  /// Pairs that another tester has taken, FeatureBlock::kCapacity at most.
  void test_features(std::span<const FeaturePair> pairs);
  void drop_pending() noexcept { block_.size = 0; }

  /// Runs `test`, and also appends the contacts found to `found`, up to max_contacts. Not nested.
  template <class Test>
  void recording_contacts(std::vector<Contact>& found, Test&& test) {
    flush();
    const Recording recording(*this, found);
    test();
    flush();
  }
  /// Runs `test`, and also stores its result in `answer`: for Report::kCount the number, else the contacts.
  template <class Test>
  void recording(RestAnswer& answer, Test&& test) {
    const std::uint64_t before = output_.counts.triangle_pairs;
    if (input_->options.report == Report::kCount)
      tallying(answer.tally, test);
    else
      recording_contacts(answer.contacts, test);
    answer.triangle_pairs += output_.counts.triangle_pairs - before;
  }
  /// Counts and reports a cached contact.
  void keep(const Contact& contact);
  /// Counts cached contacts.
  void keep(const ContactTally& tally);
  /// Notes what is kept, by this question and the one that it goes part of the way of.
  void note_kept(std::uint64_t triangle_pairs, const ContactTally& tally, std::span<const Contact> contacts);
  /// What was noted in the last question that did; valid until the next that does.
  const MetPairs& met() const { return met_; }

  /// Frees the memory that a failed step allocated.
  void release() noexcept {
    contacts_ = {};
    met_ = {};
  }

  /// Of the thread that uses this.
  StageClock& clock() { return clock_; }
  const ContactList& contacts() const { return contacts_; }
  NarrowPhaseOutput& output() { return output_; }
  const NarrowPhaseOutput& output() const { return output_; }
  std::size_t memory_bytes() const { return sizeof(*this) + contacts_.memory_bytes() + met_.memory_bytes(); }

 private:
  // Contacts go to `found`, too, until this goes: other tasks of a step that fails are not to find it there.
  class Recording {
   public:
    Recording(PairTester& tester, std::vector<Contact>& found) : tester_(tester) {
      tester_.recorder_ = &found;
    }
    ~Recording() { tester_.recorder_ = nullptr; }
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

   private:
    PairTester& tester_;
  };
  template <class Test>
  void tallying(ContactTally& tally, Test&& test) {
    flush();
    const NarrowPhaseOutput before = std::exchange(output_, {});
    test();
    flush();
    tally.found.add(output_.found);
    tally.possible += output_.possible;
    tally.earliest = std::min(tally.earliest, output_.earliest);
    output_.add(before);
  }

  // May what does not touch be in contact, in questions of distances? Points meet each other and segments
  // only then.
  bool knows_distances() const;
  // Two points, or a point and a segment.
  void point_pair(Primitive p, Primitive q);
  // Two faces, a face and a segment, or two segments. `left_out`: the pairs of their features that filters
  // leave out; of segments, those are looked for one by one. `near`: as of primitive_pair().
  void element_pair(Primitive p, Primitive q, std::uint32_t left_out, std::uint32_t near);
  // Continues with the pending pairs that no plane separates.
  void filter_elements();
  std::uint32_t elements_apart();
  void feature_pairs(std::uint32_t f, std::uint32_t g, std::uint32_t left_out, std::uint32_t near);
  void segment_pairs(Primitive p, Primitive segment);
  void edge_face_pairs(Primitive p, Primitive q);
  void edge_against_face(EdgeId edge, std::uint32_t face);
  // Tests the block's pairs and empties it.
  void test_features(FeatureBlock& block);
  /// A pair that only long integers decide takes up to milliseconds: the stop flag is looked at after each.
  void look_after_exact(std::uint64_t exact_tests) const;
  void run_cascade(std::span<const FeaturePair> pairs);
  void test_proximity(std::span<const FeaturePair> pairs);
  // Of pairs that the test reports, for Report::kVertexDistances.
  void lower_distances(std::span<const FeaturePair> pairs);
  void lower_distances(const FeaturePair& pair, double distance);
  void lower_distance(std::uint32_t v, double distance);
  // What is told of a vertex, in new numbers, so far.
  std::atomic_ref<double> distance_of(std::uint32_t v) const;
  void test_intersections(std::span<const FeaturePair> pairs);
  ElementaryOptions elementary_options() const;
  ElementaryOptions elementary_options(const PairAsked& asked) const;
  CertifiedOptions certified_options(const PairAsked& asked) const;
  // The same where each pair has a separation of its own.
  void keep_distances(std::span<const FeaturePair> pairs);
  // Of a motion: pairs of which something moves along an arc.
  void test_turning(std::span<const FeaturePair> pairs);
  TurningPair turning(const FeaturePair& pair, const FeatureVertices& features) const;
  FeatureVertices features_of(const FeaturePair& pair) const;
  void take_verdict(const FeaturePair& pair, const Verdict& verdict);
  void take_verdict(ContactKind kind, std::uint32_t a, std::uint32_t b, const Verdict& verdict);
  void vertex_against_face(std::uint32_t v, std::uint32_t f);
  TriangleBounds bounds_of(const Face& face) const { return bounds_of(face[0], face[1], face[2]); }
  TriangleBounds bounds_of(const Edge& edge) const { return bounds_of(edge[0], edge[1], edge[1]); }
  TriangleBounds bounds_of(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
  // Contacts of what has these vertices after this time, at most 1, are not needed; rounded up.
  float until_of(std::uint32_t p, std::uint32_t q) const;
  // Of the wanted pairs of features, as in Ownership::Candidates, those whose moving bounds overlap.
  std::uint32_t overlapping(const Face& p, const Face& q, std::uint32_t wanted) const;
  // Within which bounds of primitives with these vertices count as near each other: of their parts.
  Width width_of(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) const;
  // The same of two primitives: where distances are kept, none of their features has a wider separation.
  Width width_between(const Face& p, const Face& q) const;
  // Of the first and of the second feature; where anything is thick.
  std::pair<double, double> thickness_of(const FeaturePair& pair) const;
  // The question's separation for all pairs; where each has its own by keep_distance, the widest.
  double asked() const {
    return input_->room != nullptr && input_->keep.share == 0 ? input_->keep.beyond
                                                              : input_->options.min_separation;
  }
  // Of the pair, in a question with this separation for all, without room for roundings.
  double separation(const FeaturePair& pair, double asked) const;
  double separation(const FeaturePair& pair) const { return separation(pair, asked()); }
  // What a commit may round the pair by, in a question with this separation for the pair; 0 where no room is
  // asked for it.
  double room_of(const FeaturePair& pair, const FeatureVertices& features, double separation) const;
  // By the rules of WithRoom, of a pair that has room for roundings.
  template <class Pair>
  Verdict stopped(const RoomQuestion& asked, Pair&& pair) {
    const RoomVerdict told = WithRoom(asked, pair).verdict();
    if (told.overlaps) ++output_.overlaps;
    return told.verdict;
  }
  // What is asked of a pair, and what is known of it, in a question with this separation for the pair.
  double latest_of(const FeaturePair& pair) const;
  RoomQuestion room_question(const FeaturePair& pair, const FeatureVertices& features,
                             double separation) const;
  RoomPairState room_state(const FeaturePair& pair, const RoomQuestion& asked,
                           ElementaryCounts& counts) const;
  // By `test`, of a PairAsked, of a pair along lines, ...
  template <class Test>
  Verdict verdict_of(const FeaturePair& pair, const FeatureVertices& features, double separation,
                     ElementaryCounts& counts, Test& test) {
    if (input_->room == nullptr) return test(PairAsked{separation, latest_of(pair)});
    const RoomQuestion asked = room_question(pair, features, separation);
    return stopped(asked, LinesInRoom(features, room_state(pair, asked, counts), test));
  }
  // ... and of one along arcs.
  template <class Test>
  Verdict verdict_of(const FeaturePair& pair, const TurningPair& turns, double separation, Test& test) {
    if (input_->room == nullptr) return test(PairAsked{separation, latest_of(pair)});
    const RoomQuestion asked = room_question(pair, turns.features, separation);
    ElementaryCounts counts;
    const Verdict verdict = stopped(asked, ArcsInRoom(turns, room_state(pair, asked, counts), test));
    output_.counts.exact_tests += counts.exact_tests;
    return verdict;
  }
  void push(const FeaturePair& pair);
  // The same of a pair that no excluded vertices leave out.
  void push_unless_at_rest(const FeaturePair& pair);
  // Counts so many more; is there room for them?
  bool room_to_note(std::size_t more);
  void report(const Contact& contact);
  // Of Report::kEarliest.
  void keep_earliest(const Contact& contact);
  // Removes what is no longer the earliest of its world.
  void drop_later();
  bool asks_for_earliest() const { return input_->options.report == Report::kEarliest; }
  float until_in(std::uint32_t world) const;
  // The place of the world that these two vertices are in.
  std::uint32_t world_around(std::uint32_t vertex_a, std::uint32_t vertex_b) const;
  // The same of a vertex and a body.
  std::uint32_t world_of_bodies(std::uint32_t vertex, std::uint32_t body) const;
  // The least toi found so far in the world of a pair.
  double earliest_around(const FeaturePair& pair) const;

  const NarrowPhaseInput* input_ = nullptr;
  NarrowPhaseShared* shared_ = nullptr;
  ContactList contacts_;
  std::uint32_t world_ = 0;    // of the leaves in hand, by its place
  bool turning_ = false;       // of these: does either part move along a screw?
  std::size_t most_kept_ = 0;  // of Report::kEarliest with worlds: then later ones are dropped
  std::vector<Contact>* recorder_ = nullptr;
  MetPairs met_;
  NarrowPhaseOutput output_;
  StageClock clock_;
  struct ElementPair {
    Primitive p;
    Primitive q;
    std::uint32_t left_out;  // of their features
    std::uint32_t near;      // the others have been shown to be apart
  };
  std::array<ElementPair, 8> elements_;  // pending
  std::size_t element_pairs_ = 0;
  EightTrianglePairs corners_;  // their corners
  FeatureBlock block_;
};

}  // namespace warmfront
