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
    double rounding = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (side(k) == which) rounding = std::max(rounding, paths_[k].rounding);
    }
    return rounding;
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
  CertifiedOptions of_piece = options;
  of_piece.latest = 1;
  const double resolution = options.tolerance * margins.size;
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
  return search(margins, resolution, options.latest, reports, proves);
}

// How far points of a side travel at most.
double way_of_side(const TurningPair& pair, std::size_t which) {
  const std::size_t of_first = pair.features.kind == ContactKind::kVertexFace ? 1 : 2;
  double way = 0;
  for (std::size_t k = which == 0 ? 0 : of_first; k < (which == 0 ? of_first : 4); ++k)
    way = std::max(way, way_of(*pair.features.vertex[k]));
  return way + Chords(pair).arc_of_side(which);
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
  const double distance = distance_above(closest_direction(query, 0));
  const double own = std::max((keep.share * distance + (1 - keep.share) * beyond) * (1 + 0x1p-48), beyond);
  if (!(distance_below(query, 0.0) > own * (1 + 0x1p-40) + 0x1p-40))
    return {true, ContactStatus::kOverlapAtStart, 0};
  const double widest = keep.widest(way_of_side(pair, 0), way_of_side(pair, 1));
  options.min_separation = std::min(query.unscaled(own) * (1 + 0x1p-40), widest);
  const double approach = (1 - keep.share) * std::max(0.0, distance - beyond);
  options.tolerance = std::min(options.tolerance, std::max(0x1p-40, 0x1p-7 * approach / query.size));
  return search_pair(pair, options);
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
