// SPDX-License-Identifier: Apache-2.0
// Pairs of features.
#include "engine/elementary/turning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "engine/elementary/candidate.h"
#include "engine/elementary/closest.h"
#include "engine/elementary/distance_below.h"
#include "engine/elementary/turning_search.h"
#include "engine/motion/longest_way.h"

namespace warmfront {

using namespace turning;

namespace {

// Each leads to the middle of some piece, from where widths double again: 26 times at most, so that all
// pieces of a pair whose chords are apart in pieces of 2^-5 or shorter stay fewer than kMostPieces.
constexpr int kMostAdvances = 16;

/// Both primitives, whose vertices are at any time where their paths lead.
class Chords {
 public:
  explicit Chords(const TurningPair& pair)
      : pair_(pair),
        base_(pair.features.vertex[0]->t0),
        of_first_(pair.features.kind == ContactKind::kVertexFace ? 1 : 2),
        paths_{path(0), path(1), path(2), path(3)} {}

  Margins margins() const {
    double size = 0;
    for (const Path& path : paths_) size = std::max(size, path.size());
    return {bend_of(0) + bend_of(1), rounding_of(0) + rounding_of(1), size};
  }

  /// No point of a side is farther from its line.
  double arc_of_side(std::size_t which) const { return bend_of(which) / 8 + rounding_of(which); }

  /// A time, from `begin` on, up to which the arcs certainly stay farther apart than `separation`:
  /// conservative advancement (Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, 1996, 2.3.2).
  /// The direction between the closest points keeps them apart for as long as what they have in it lasts
  /// against their velocity and the greatest second derivative. Ends where it gains less than `least`, or
  /// has come to `enough`.
  double apart_until(double begin, double separation, const Margins& margins, double least,
                     double enough = 1) const {
    if (!squares_serve(margins) || !(separation < 0x1p300)) return begin;
    const double kept = separation + kept_besides(margins);
    double s = begin;
    for (int k = 0; k < kMostSteps && s < 1 && s < enough; ++k) {
      const double more = kept_apart(s, kept, margins.bend);
      if (more > 0) s = time_of(s, std::min(more, 1.0));
      if (!(more >= least)) break;
    }
    return s;
  }

  /// Are points of both, at time s on their lines, certainly no farther apart than that?
  bool lines_come_within(double s, double distance, const Margins& margins) const {
    if (!squares_serve(margins)) return false;
    std::array<Vec3, 4> at;
    for (std::size_t k = 0; k < 4; ++k) at[k] = paths_[k].from_base(s, {});
    return norm(between(at)) + 0x1p-40 * margins.size < distance;
  }

  Verdict test(double begin, double width, const CertifiedOptions& options) const {
    const ArcShares from[2] = {shares_at(pair_.first, begin), shares_at(pair_.second, begin)};
    const ArcShares to[2] = {shares_at(pair_.first, begin + width), shares_at(pair_.second, begin + width)};
    std::array<VertexMotion, 4> chords;
    FeatureVertices features{pair_.features.kind, {}};
    for (std::size_t k = 0; k < 4; ++k) {
      chords[k] = {paths_[k].at(begin, from[side(k)]), paths_[k].at(begin + width, to[side(k)])};
      features.vertex[k] = &chords[k];
    }
    return certified_test(features, options);
  }

 private:
  static constexpr int kMostSteps = 24;

  // Elsewhere they may overflow or vanish.
  static bool squares_serve(const Margins& margins) {
    return margins.size > 0x1p-300 && margins.size < 0x1p300;
  }

  // From a point of the first, near the closest one, to such a point of the second.
  Vec3 between(const std::array<Vec3, 4>& at) const {
    const Vec3 a = at[1] - at[0];
    const Vec3 b = at[2] - at[0];
    const Vec3 c = at[3] - at[0];
    return of_first_ == 1 ? closest_on_triangle(a, b, c) : closest_between_edges(a, b, c);
  }

  // For how long, after s, a direction keeps the arcs farther apart than `kept`. Of a gap f between vertices,
  // f(s + h) >= f(s) + h f'(s) - h^2 bend / 2, in a direction of length 1.
  double kept_apart(double s, double kept, double bend) const {
    std::array<Vec3, 4> at;
    std::array<Vec3, 4> velocity;
    const ArcRates of[2] = {rates_at(pair_.first, s), rates_at(pair_.second, s)};
    for (std::size_t k = 0; k < 4; ++k) {
      at[k] = paths_[k].from_base(s, of[side(k)].shares);
      velocity[k] = paths_[k].velocity(of[side(k)].rates);
    }
    const Vec3 direction = normalised(between(at));
    const double length = norm(direction);
    if (!(length > 0)) return 0;
    const double against = bend * length * (1 + 0x1p-40);
    double least = 2;
    for (std::size_t i = 0; i < of_first_; ++i) {
      for (std::size_t j = of_first_; j < 4; ++j) {
        const double left = dot(direction, at[j] - at[i]) - kept * length;
        if (!(left > 0)) return 0;
        const double rate = dot(direction, velocity[j] - velocity[i]);
        least = std::min(least, time_left(left, rate, against));
      }
    }
    return least * (1 - 0x1p-40);
  }

  std::size_t side(std::size_t k) const { return k < of_first_ ? 0 : 1; }
  Path path(std::size_t k) const {
    return {*pair_.features.vertex[k], side(k) == 0 ? pair_.first : pair_.second, base_};
  }
  double bend_of(std::size_t which) const {
    double bend = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (side(k) == which) bend = std::max(bend, length_above(paths_[k].bend));
    }
    return bend;
  }
  double rounding_of(std::size_t which) const {
    const Twist* twist = which == 0 ? pair_.first : pair_.second;
    if (twist == nullptr) return 0;
    double away = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (side(k) == which) away = std::max(away, from_centre(*pair_.features.vertex[k], *twist));
    }
    return rounding_of_bend(*twist, away);
  }

  const TurningPair& pair_;
  std::array<double, 4> base_;
  std::size_t of_first_;
  std::array<Path, 4> paths_;
};

// Within a separation that is no multiple of the arcs' own, `separation` and less.
Verdict search_pair(const TurningPair& pair, const CertifiedOptions& options) {
  const Chords chords(pair);
  const Margins margins = chords.margins();
  if (!margins.finite()) return {true, ContactStatus::kOverlapAtStart, 0};
  CertifiedOptions of_piece = options;
  of_piece.latest = 1;
  const double resolution = options.tolerance * margins.size;
  const double finest = margins.finest(resolution);
  // From there on a piece begins after `latest`, and nothing of it is asked.
  const double enough = options.latest + 2 * finest;
  int advances = 0;
  const auto advance = [&](double begin) {
    if (++advances > kMostAdvances || begin >= 1) return begin;
    const double until = chords.apart_until(begin, options.min_separation, margins, finest, enough);
    return std::max(begin, std::floor(until / finest) * finest);
  };
  const auto reports = [&](double begin, double width, double margin) {
    // A piece that is halved where it reports need not say so precisely. Of the whole motion all is told, so
    // that what culls leave out ends there.
    const bool halved = width < 1 && margin - margins.rounding > resolution;
    of_piece.tolerance = halved ? std::max(options.tolerance, std::min(0.25, 0.25 * margin / margins.size))
                                : options.tolerance;
    of_piece.min_separation = finite_sum(options.min_separation, margin);
    return chords.test(begin, width, of_piece);
  };
  const auto proves = [&](double begin, double width, double margin) {
    if (!(options.min_separation > margin)) return false;
    of_piece.tolerance = options.tolerance;
    of_piece.min_separation = (options.min_separation - margin) * (1 - 0x1p-50);
    const Verdict verdict = chords.test(begin, width, of_piece);
    return verdict.contact && verdict.status == ContactStatus::kHit;
  };
  const Verdict verdict = search(margins, resolution, finest, options.latest, advance, reports, proves);
  // What culls leave out is told by the whole motion, of which the test misses nothing.
  if (!verdict.contact || finest == 1) return verdict;
  const double whole = margins.of(1);
  if (chords.lines_come_within(verdict.toi, finite_sum(options.min_separation, whole), margins))
    return verdict;
  return reports(0, 1, whole).contact ? verdict : Verdict{};
}

// How far points of a side travel at most.
double way_of_side(const TurningPair& pair, const Chords& chords, std::size_t which) {
  const std::size_t of_first = pair.features.kind == ContactKind::kVertexFace ? 1 : 2;
  double way = 0;
  for (std::size_t k = which == 0 ? 0 : of_first; k < (which == 0 ? of_first : 4); ++k)
    way = std::max(way, way_of(*pair.features.vertex[k]));
  return way + chords.arc_of_side(which);
}

// Is a pair, that has so much to approach, told of no earlier than that? The direction of the closest points
// at the start keeps it beyond its own separation by more than a piece that is told of is from its chords,
// twice, and what the test of these allows itself; pieces that are no shorter than a sixth of the square root
// of `latest` do so, too, so that they are too few for kBudget.
// `way`: how far points of both travel at most, together. A velocity differs from its mean, along the line,
// by no more than half of the greatest second derivative.
bool surely_later(const Chords& chords, double way, double approach, const CertifiedOptions& options) {
  const double speed = way + 3 * (chords.arc_of_side(0) + chords.arc_of_side(1));
  const double allowed = (4 * options.tolerance + 0x1p-16) * 2 * chords.margins().size;
  return approach > (speed * options.latest + allowed) * (1 + 0x1p-2);
}

}  // namespace

Verdict turning_test(const TurningPair& pair, const CertifiedOptions& options) {
  return search_pair(pair, options);
}

Verdict turning_keep_distance_test(const TurningPair& pair, const KeepDistance& keep,
                                   CertifiedOptions options) {
  std::array<VertexMotion, 4> resting;
  FeatureVertices at_start{pair.features.kind, {}};
  for (std::size_t k = 0; k < 4; ++k) {
    resting[k] = {pair.features.vertex[k]->t0, pair.features.vertex[k]->t0};
    at_start.vertex[k] = &resting[k];
  }
  Query query = Query::prepare(at_start, 0);
  if (query.size == 0) return {true, ContactStatus::kOverlapAtStart, 0};
  const double beyond = query.scaled(keep.beyond);
  const double distance = starts_apart(query, closest_direction(query, 0));
  const double own = std::max((keep.share * distance + (1 - keep.share) * beyond) * (1 + 0x1p-48), beyond);
  const double below = distance_below(query, 0.0);
  if (!(below > own * (1 + 0x1p-40) + 0x1p-40)) return {true, ContactStatus::kOverlapAtStart, 0};
  const Chords chords(pair);
  const double way_of_first = way_of_side(pair, chords, 0);
  const double way_of_second = way_of_side(pair, chords, 1);
  const double widest = keep.widest(way_of_first, way_of_second);
  options.min_separation = std::min(query.unscaled(own) * (1 + 0x1p-40), widest);
  const double approach = (1 - keep.share) * std::max(0.0, distance - beyond);
  options.tolerance = std::min(options.tolerance, std::max(0x1p-40, 0x1p-7 * approach / query.size));
  const double least = query.unscaled((1 - keep.share) * std::max(0.0, below - beyond) * (1 - 0x1p-40));
  if (surely_later(chords, way_of_first + way_of_second, least, options)) return {};
  return search_pair(pair, options);
}

bool turning_comes_within(const TurningPair& pair, double separation) {
  const Chords chords(pair);
  const Margins margins = chords.margins();
  if (!margins.finite()) return true;
  double s = 0;
  for (int advances = 0; advances < kMostAdvances; ++advances) {
    const double until = chords.apart_until(s, separation, margins, 0);
    if (until >= 1) return false;
    if (!(until > s)) break;
    s = until;
  }
  return search_pair(pair, {.tolerance = kFineArcs, .min_separation = separation}).contact;
}

double turning_slack(const TurningPair& pair) {
  return slack_of(Chords(pair).margins());
}

Verdict turning_candidate_test(const TurningPair& pair, double min_separation) {
  const Margins margins = Chords(pair).margins();
  return candidate_test(pair.features, finite_sum(min_separation, margins.of(1)));
}

std::array<double, 4> on_arc(const VertexMotion& vertex, const Twist& twist, double s) {
  if (s == 1) return vertex.t1;
  return Path(vertex, &twist, {}).at(s, shares_at(&twist, s));
}

}  // namespace warmfront
