// SPDX-License-Identifier: Apache-2.0
// PairTester's tests: a block of feature pairs, through the filters and the elementary test that the question
// asks for. Pairs come from pair_tester.cpp, and contacts go to contact_reports.cpp.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

#include "engine/elementary/candidate.h"
#include "engine/elementary/edge_face.h"
#include "engine/elementary/elementary_test.h"
#include "engine/elementary/keep_distance.h"
#include "engine/elementary/proximity.h"
#include "engine/narrow_phase/coplanarity_filter.h"
#include "engine/narrow_phase/pair_tester.h"
#include "engine/narrow_phase/proximity_filter.h"
#include "engine/narrow_phase/rest_filter.h"
#include "engine/narrow_phase/separation_filter.h"

namespace warmfront {
namespace {

// The largest coordinate of a half-space's point at either end.
double farthest(const HalfSpaceMotion& half_space) {
  double most = 0;
  for (const auto& point : half_space.point) {
    for (const double x : point) most = std::max(most, std::fabs(x));
  }
  return most;
}

}  // namespace

FeatureVertices PairTester::features_of(const FeaturePair& pair) const {
  FeatureVertices features{tested_as(pair.kind), {}};
  for (int k = 0; k < 4; ++k) features.vertex[k] = &input_->vertices[pair.vertices[k]];
  return features;
}

void PairTester::take_verdict(const FeaturePair& pair, const Verdict& verdict) {
  take_verdict(pair.kind, pair.a, pair.b, verdict);
}

void PairTester::take_verdict(ContactKind kind, std::uint32_t a, std::uint32_t b, const Verdict& verdict) {
  if (!verdict.contact) return;
  if (input_->options.leave_out_overlaps && verdict.status == ContactStatus::kOverlapAtStart)
    ++output_.overlaps;
  else
    report(input_->numbering.given({kind, verdict.status, a, b, verdict.toi}));
}

void PairTester::vertex_half_space(std::uint32_t v, const VertexMotion& vertex,
                                   const HalfSpaceMotion& half_space, std::uint32_t body, double thickness) {
  const ColliderOptions& options = input_->options;
  const double of_vertex = input_->thickness.any() ? input_->thickness.of(v) : 0;
  const auto separated = [&](double asked) { return separation_of(asked, of_vertex, thickness); };
  ElementaryOptions elementary = elementary_options();
  elementary.min_separation = separated(asked());
  if (options.report == Report::kEarliest)
    elementary.latest = std::min(1.0, shared_->earliest.of(world_of_bodies(v, body)));
  ElementaryCounts counts;
  Verdict verdict;
  const Twist* twist = input_->arcs.around(v);
  const double share = input_->keep.share;
  if (options.pair_test == PairTest::kProximity) {
    verdict = half_space_proximity(vertex, half_space, options.instant, elementary, counts);
    if (verdict.contact && options.report == Report::kVertexDistances)
      lower_distance(v, beyond_thickness(half_space_distance(vertex, half_space, options.instant), of_vertex,
                                         thickness));
  } else if (options.report == Report::kCandidates) {
    verdict = twist != nullptr ? turning_half_space_candidate(vertex, *twist, half_space, elementary, counts)
                               : half_space_candidate(vertex, half_space, elementary, counts);
  } else {
    const auto test = [&](const PairAsked& now) {
      const ElementaryOptions of_now = elementary_options(now);
      const KeepDistance keep{share, now.separation};
      if (twist != nullptr) {
        return share > 0 ? turning_half_space_keep_distance(vertex, *twist, half_space, keep, of_now, counts)
                         : turning_half_space_test(vertex, *twist, half_space, of_now, counts);
      }
      return share > 0 ? half_space_keep_distance(vertex, half_space, keep, now.latest, counts)
                       : half_space_test(vertex, half_space, of_now, counts);
    };
    const double separation = separated(share > 0 ? input_->keep.beyond : asked());
    if (input_->room == nullptr) {
      verdict = test(PairAsked{separation, elementary.latest});
    } else {
      const double rounds = input_->room->of(v, vertex, body, farthest(half_space));
      const double room = std::max(rounds, CommitRoom::least_of(pair_size(vertex, half_space), separation));
      const RoomQuestion question{separation, room, elementary.latest, options.leave_out_overlaps};
      // Of a half-space that goes by poses a commit rounds point and normal, also where both ends are the
      // same.
      const bool stays = !input_->room->goes_by_poses(body);
      const bool by_itself = stays && input_->room->by_themselves({&v, 1}, input_->vertices);
      const bool straight = by_itself || (stays && input_->room->leave_straight({&v, 1}, input_->vertices));
      const RoomPairState state{rounds == 0 && !half_space.moves(), by_itself, straight, separation, counts};
      verdict = stopped(question, HalfSpaceInRoom(vertex, twist, half_space, state, test));
    }
  }
  ++output_.counts.elementary_tests;
  output_.counts.exact_tests += counts.exact_tests;
  take_verdict(ContactKind::kVertexHalfSpace, v, body, verdict);
  look_after_exact(counts.exact_tests);
}

void PairTester::test_features(FeatureBlock& block) {
  if (block.size == 0) return;
  const EmptiedBlock emptied(block);
  input_->stop.check();
  const StageClock::In elementary(clock_, Stage::kElementary);
  if (input_->filter.rest_distance() > 0 && input_->options.pair_test != PairTest::kIntersection)
    output_.counts.feature_pairs_filtered += drop_near_at_rest(input_->filter, block);
  output_.counts.elementary_tests += block.size;
  std::span<const FeaturePair> pairs(block.pairs.data(), block.size);
  if (input_->arcs.any() && input_->options.pair_test == PairTest::kMotion) {
    const auto along_lines =
        std::partition(block.pairs.begin(), block.pairs.begin() + static_cast<std::ptrdiff_t>(block.size),
                       [this](const FeaturePair& pair) {
                         return input_->arcs.around(pair.vertices.front()) == nullptr &&
                                input_->arcs.around(pair.vertices.back()) == nullptr;
                       });
    const auto lines = static_cast<std::size_t>(along_lines - block.pairs.begin());
    test_turning(pairs.subspan(lines));
    pairs = pairs.first(lines);
  }
  if (input_->options.pair_test == PairTest::kProximity) {
    test_proximity(pairs);
  } else if (input_->options.pair_test == PairTest::kIntersection) {
    test_intersections(pairs);
  } else if (input_->options.report == Report::kCandidates) {
    for (const FeaturePair& pair : pairs)
      take_verdict(pair, candidate_test(features_of(pair), separation(pair)));
  } else if (input_->keep.share > 0) {
    keep_distances(pairs);
  } else {
    run_cascade(pairs);
  }
}

void PairTester::test_features(std::span<const FeaturePair> pairs) {
  FeatureBlock block;
  std::ranges::copy(pairs, block.pairs.begin());
  block.size = pairs.size();
  test_features(block);
}

void PairTester::look_after_exact(std::uint64_t exact_tests) const {
  if (exact_tests > 0) input_->stop.check();
}

void PairTester::run_cascade(std::span<const FeaturePair> pairs) {
  const ColliderOptions& options = input_->options;
  std::array<std::uint16_t, FeatureBlock::kCapacity> survivors;
  std::array<double, FeatureBlock::kCapacity> separations;
  const bool separated = options.min_separation > 0 || input_->thickness.any();
  if (separated) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double own = separation(pairs[i]);
      separations[i] = own + CommitRoom::kAway * room_of(pairs[i], features_of(pairs[i]), own);
    }
  }
  std::size_t count = coplanarity_filter(
      pairs, input_->vertices, {separations.data(), separated ? pairs.size() : 0}, survivors.data());
  output_.counts.coplanarity_passed += count;
  if (!separated) count = separation_filter(pairs, input_->vertices, survivors.data(), count);
  ElementaryCounts counts;
  for (std::size_t i = 0; i < count; ++i) {
    const FeaturePair& pair = pairs[survivors[i]];
    const std::uint64_t before = counts.exact_tests;
    const FeatureVertices features = features_of(pair);
    const auto test = [&](const PairAsked& now) {
      return elementary_test(features, elementary_options(now), counts);
    };
    take_verdict(pair, verdict_of(pair, features, separation(pair), counts, test));
    look_after_exact(counts.exact_tests - before);
  }
  output_.counts.exact_tests += counts.exact_tests;
}

TurningPair PairTester::turning(const FeaturePair& pair, const FeatureVertices& features) const {
  return {features, input_->arcs.around(pair.vertices.front()), input_->arcs.around(pair.vertices.back())};
}

// No filter of many pairs comes before: these know of lines.
void PairTester::test_turning(std::span<const FeaturePair> pairs) {
  const ColliderOptions& options = input_->options;
  const double share = input_->keep.share;
  for (const FeaturePair& pair : pairs) {
    const FeatureVertices features = features_of(pair);
    const TurningPair turns = turning(pair, features);
    input_->stop.check();
    if (options.report == Report::kCandidates) {
      take_verdict(pair, turning_candidate_test(turns, separation(pair)));
      continue;
    }
    const auto test = [&](const PairAsked& now) {
      return share > 0 ? turning_keep_distance_test(turns, {share, now.separation}, certified_options(now))
                       : turning_test(turns, certified_options(now));
    };
    const double own = separation(pair, share > 0 ? input_->keep.beyond : asked());
    take_verdict(pair, verdict_of(pair, turns, own, test));
  }
}

// None of the filters before it that exclude pairs of a motion.
void PairTester::test_proximity(std::span<const FeaturePair> pairs) {
  ElementaryOptions elementary = elementary_options();
  ElementaryCounts counts;
  const Instant instant = input_->options.instant;
  const double toi = instant == Instant::kStart ? 0 : 1;
  const bool by_vertex = input_->options.report == Report::kVertexDistances;
  std::array<double, FeatureBlock::kCapacity> separations;
  std::array<Nearness, FeatureBlock::kCapacity> nearness;
  for (std::size_t i = 0; i < pairs.size(); ++i) separations[i] = separation(pairs[i]);
  proximity_filter(pairs, input_->vertices, instant, {separations.data(), pairs.size()}, nearness.data());
  std::size_t reported = 0;
  std::array<FeaturePair, FeatureBlock::kCapacity> near;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (nearness[i] == Nearness::kApart) continue;
    const FeaturePair& pair = pairs[i];
    const std::uint64_t before = counts.exact_tests;
    elementary.min_separation = separations[i];
    const Verdict verdict = nearness[i] == Nearness::kNear
                                ? Verdict{true, ContactStatus::kHit, toi}
                                : proximity_test(features_of(pair), instant, elementary, counts);
    look_after_exact(counts.exact_tests - before);
    if (by_vertex && verdict.contact) near[reported++] = pair;
    take_verdict(pair, verdict);
  }
  output_.counts.exact_tests += counts.exact_tests;
  lower_distances({near.data(), reported});
}

// Only pairs that the test reports count, so that no distance depends on what was looked at. Of these, most
// are farther apart than anything that a vertex of theirs is known to be near by then: least_distance() is
// less than 2^-19 of the size below the distance, so that it would lower none.
void PairTester::lower_distances(std::span<const FeaturePair> pairs) {
  if (pairs.empty()) return;
  const Instant instant = input_->options.instant;
  std::array<double, FeatureBlock::kCapacity> told;  // by now, of the four vertices at most
  std::array<Nearness, FeatureBlock::kCapacity> nearness;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    double most = 0;
    for (const std::uint32_t v : pairs[i].vertices)
      most = std::max(most, distance_of(v).load(std::memory_order_relaxed));
    told[i] = separation(pairs[i], most) * (1 + 0x1p-48);
  }
  proximity_filter(pairs, input_->vertices, instant, {told.data(), pairs.size()}, nearness.data(), 0x1p-18);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (nearness[i] != Nearness::kApart)
      lower_distances(pairs[i], least_distance(features_of(pairs[i]), instant, separation(pairs[i])));
  }
}

void PairTester::lower_distances(const FeaturePair& pair, double distance) {
  if (input_->thickness.any()) {
    const auto [a, b] = thickness_of(pair);
    distance = beyond_thickness(distance, a, b);
  }
  for (const std::uint32_t v : pair.vertices) lower_distance(v, distance);
}

void PairTester::lower_distance(std::uint32_t v, double distance) {
  const std::atomic_ref<double> least = distance_of(v);
  double now = least.load(std::memory_order_relaxed);
  while (distance < now && !least.compare_exchange_weak(now, distance, std::memory_order_relaxed)) {
  }
}

std::atomic_ref<double> PairTester::distance_of(std::uint32_t v) const {
  return std::atomic_ref<double>(input_->vertex_distances[number_of(input_->numbering.given(NewVertex{v}))]);
}

void PairTester::test_intersections(std::span<const FeaturePair> pairs) {
  const ColliderOptions& options = input_->options;
  const bool first_ends = options.report == Report::kAny;
  const double toi = options.instant == Instant::kStart ? 0 : 1;
  for (const FeaturePair& pair : pairs) {
    if (first_ends && shared_->contacts.load(std::memory_order_relaxed) > 0) return;
    EdgeFaceVertices vertices;
    const Edge& edge = input_->scene.edges()[pair.a];
    const Face& face = input_->scene.faces()[pair.b];
    for (std::size_t k = 0; k < 5; ++k) vertices[k] = &input_->vertices[k < 2 ? edge[k] : face[k - 2]];
    const std::uint64_t before = output_.counts.exact_tests;
    if (edge_meets_face(vertices, options.instant, output_.counts.exact_tests))
      report(input_->numbering.given({pair.kind, ContactStatus::kHit, pair.a, pair.b, toi}));
    look_after_exact(output_.counts.exact_tests - before);
  }
}

ElementaryOptions PairTester::elementary_options() const {
  const ColliderOptions& options = input_->options;
  return {.tier = options.tier, .tolerance = options.tolerance, .min_separation = asked()};
}

ElementaryOptions PairTester::elementary_options(const PairAsked& asked) const {
  const ColliderOptions& options = input_->options;
  return {.tier = options.tier,
          .tolerance = options.tolerance,
          .min_separation = asked.separation,
          .latest = asked.latest};
}

CertifiedOptions PairTester::certified_options(const PairAsked& asked) const {
  return {.tolerance = input_->options.tolerance, .min_separation = asked.separation, .latest = asked.latest};
}

// No filter of many pairs comes before: these know of one separation for all, and the answer may not depend
// on what that is.
void PairTester::keep_distances(std::span<const FeaturePair> pairs) {
  ElementaryCounts counts;
  for (const FeaturePair& pair : pairs) {
    const std::uint64_t before = counts.exact_tests;
    const FeatureVertices features = features_of(pair);
    const auto test = [&](const PairAsked& now) {
      return keep_distance_test(features, {input_->keep.share, now.separation}, certified_options(now));
    };
    take_verdict(pair, verdict_of(pair, features, separation(pair, input_->keep.beyond), counts, test));
    look_after_exact(counts.exact_tests - before);
  }
  output_.counts.exact_tests += counts.exact_tests;
}

double PairTester::latest_of(const FeaturePair& pair) const {
  return asks_for_earliest() ? std::min(1.0, earliest_around(pair)) : 1;
}

double PairTester::room_of(const FeaturePair& pair, const FeatureVertices& features,
                           double separation) const {
  if (input_->room == nullptr) return 0;
  return std::max(input_->room->of(pair.vertices, input_->vertices),
                  CommitRoom::least_of(pair_size(features), separation));
}

RoomQuestion PairTester::room_question(const FeaturePair& pair, const FeatureVertices& features,
                                       double separation) const {
  return {separation, room_of(pair, features, separation), latest_of(pair),
          input_->options.leave_out_overlaps};
}

RoomPairState PairTester::room_state(const FeaturePair& pair, const RoomQuestion& asked,
                                     ElementaryCounts& counts) const {
  const bool by_itself = input_->room->by_themselves(pair.vertices, input_->vertices);
  return {input_->room->of(pair.vertices, input_->vertices) == 0, by_itself,
          by_itself || input_->room->leave_straight(pair.vertices, input_->vertices),
          asked.separation + CommitRoom::kNear * asked.room, counts};
}

}  // namespace warmfront
