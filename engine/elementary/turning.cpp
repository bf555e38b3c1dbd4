// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/turning.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "engine/elementary/candidate.h"
#include "engine/elementary/closest.h"
#include "engine/elementary/distance_below.h"
#include "engine/motion/longest_way.h"

namespace warmfront {
namespace {

using Vector = std::array<double, 3>;

/// No piece is shorter: times are whole multiples of it, exactly.
constexpr int kHalvings = 26;
constexpr double kShortest = 0x1p-26;

Vector minus(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

double largest(const Vector& v) {
  return std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])});
}

/// A vertex's path, from some point near the pair.
struct Path {
  Vector start;
  Vector way;
  Vector bend{};
  Vector turn{};
  double rounding = 0;  // what the bend is off by, at most

  Path(const VertexMotion& vertex, const Twist* twist, const std::array<double, 4>& base)
      : start(minus(vertex.t0, base)), way(minus(vertex.t1, vertex.t0)) {
    if (twist == nullptr) return;
    const Vector x{vertex.t0[0], vertex.t0[1], vertex.t0[2]};
    bend = twist->bend_at(x);
    rounding = rounding_of_bend(
        *twist, length_above({x[0] - twist->centre[0], x[1] - twist->centre[1], x[2] - twist->centre[2]}));
    const Vector& a = twist->angular;
    turn = {a[1] * bend[2] - a[2] * bend[1], a[2] * bend[0] - a[0] * bend[2],
            a[0] * bend[1] - a[1] * bend[0]};
  }

  std::array<double, 4> at(double s, const ArcShares& shares) const {
    std::array<double, 4> x{};
    for (std::size_t k = 0; k < 3; ++k)
      x[k] = (start[k] + s * way[k]) + (shares.of_bend * bend[k] + shares.of_turn * turn[k]);
    return x;
  }

  double size() const {
    Vector end;
    for (std::size_t k = 0; k < 3; ++k) end[k] = start[k] + way[k];
    return std::max(largest(start), largest(end));
  }
};

ArcShares shares_at(const Twist* twist, double s) {
  return twist == nullptr ? ArcShares{} : arc_shares(*twist, s);
}

/// How far chords are from arcs.
struct Margins {
  double bend = 0;      ///< of both sides together
  double rounding = 0;  ///< of positions
  double size = 0;      ///< L of turning_test()

  Margins(double bend_of_both, double rounding_of_arcs, double size_of_ends)
      : bend(bend_of_both), size(size_of_ends + bend_of_both) {
    rounding = rounding_of_arcs + 0x1p-46 * size;
  }
  bool finite() const { return std::isfinite(size) && std::isfinite(rounding) && std::isfinite(bend); }
  double of(double width) const { return (width * width * bend / 8) * (1 + 0x1p-50) + rounding; }
};

/// The length of the piece that comes next, after all that lie before `begin` in (0, 1): what was halved last
/// and whose later half waits.
double width_after(double begin) {
  const auto units = static_cast<std::uint64_t>(std::ldexp(begin, kHalvings));
  return std::ldexp(1.0, std::countr_zero(units) - kHalvings);
}

// A sum of two times, rounded down.
double time_of(double begin, double more) {
  const double sum = begin + more;
  return sum - begin > more || sum - more > begin ? std::nextafter(sum, 0.0) : sum;
}

/// The pieces, the earliest first, until one reports whose arcs are within `resolution` of their chords.
/// `reports(begin, width, margin)` tests a piece's chords, of which times are [0, 1], for coming
/// within the margin beyond the separation; `proves(begin, width, margin)` whether they come nearer than that
/// before it.
template <class Reports, class Proves>
Verdict search(const Margins& margins, double resolution, double latest, Reports&& reports, Proves&& proves) {
  if (!margins.finite()) return {true, ContactStatus::kOverlapAtStart, 0};
  double begin = 0;
  double width = 1;
  for (int pieces = 1; begin <= latest; ++pieces) {
    if (pieces > kMostPieces) return Verdict::at(begin, ContactStatus::kBudget);
    const double margin = margins.of(width);
    // All of it: what is first in a piece may be found earlier in a part of it, by rounding, and must not
    // depend on what else is asked about.
    const Verdict verdict = reports(begin, width, margin);
    if (!verdict.contact) {
      begin += width;
      if (begin >= 1) return {};
      width = width_after(begin);
    } else if (width > kShortest && margin - margins.rounding > resolution) {
      width /= 2;
      if (verdict.toi >= 0.5) begin += width;  // nothing was found before
    } else {
      const double toi = time_of(begin, verdict.toi * width);
      if (toi > latest) return {};
      if (verdict.status == ContactStatus::kBudget) return Verdict::at(toi, ContactStatus::kBudget);
      return Verdict::at(toi, proves(begin, width, margin) ? ContactStatus::kHit : ContactStatus::kPossible);
    }
  }
  return {};
}

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

double finite_sum(double a, double b) {
  return std::min(a + b, std::numeric_limits<double>::max());
}

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

namespace {

/// A vertex and the half-space, from where the vertex begins.
class HalfSpaceChords {
 public:
  HalfSpaceChords(const VertexMotion& vertex, const Twist& twist, const HalfSpaceMotion& half_space)
      : twist_(twist), path_(vertex, &twist, vertex.t0), half_space_(half_space) {
    for (Vector& point : half_space_.point) {
      for (std::size_t k = 0; k < 3; ++k) point[k] -= vertex.t0[k];
    }
  }

  Margins margins() const {
    const auto& [from, to] = half_space_.point;
    Vector way;
    for (std::size_t k = 0; k < 3; ++k) way[k] = to[k] - from[k];
    const double away = std::max(largest(from), largest(to));
    return {length_above(path_.bend), path_.rounding + 0x1p-46 * away, std::max(path_.size(), largest(way))};
  }

  VertexMotion vertex(double begin, double width) const {
    return {path_.at(begin, shares_at(&twist_, begin)),
            path_.at(begin + width, shares_at(&twist_, begin + width))};
  }
  HalfSpaceMotion half_space(double begin, double width) const {
    const auto between = [&](const std::array<Vector, 2>& ends, double s) {
      if (s == 0 || s == 1 || ends[0] == ends[1]) return ends[s == 1 ? 1 : 0];
      Vector at;
      for (std::size_t k = 0; k < 3; ++k) at[k] = ends[0][k] + s * (ends[1][k] - ends[0][k]);
      return at;
    };
    const auto& [point, normal] = half_space_;
    return {{between(point, begin), between(point, begin + width)},
            {between(normal, begin), between(normal, begin + width)}};
  }

 private:
  const Twist& twist_;
  Path path_;
  HalfSpaceMotion half_space_;
};

Verdict search_half_space(const VertexMotion& vertex, const Twist& twist, const HalfSpaceMotion& half_space,
                          const ElementaryOptions& options, ElementaryCounts& counts) {
  const HalfSpaceChords chords(vertex, twist, half_space);
  const Margins margins = chords.margins();
  ElementaryOptions of_piece = options;
  of_piece.tier = Tier::kCertified;
  of_piece.latest = 1;
  const auto reports = [&](double begin, double width, double margin) {
    of_piece.min_separation = finite_sum(options.min_separation, margin);
    return half_space_test(chords.vertex(begin, width), chords.half_space(begin, width), of_piece, counts);
  };
  // Is the vertex, at the piece's end, within by more than its arc can be off?
  const auto proves = [&](double begin, double width, double margin) {
    const VertexMotion chord = chords.vertex(begin, width);
    const HalfSpaceMotion then = chords.half_space(begin, width);
    const Vec3 n{then.normal[1][0], then.normal[1][1], then.normal[1][2]};
    const Vec3 d{chord.t1[0] - then.point[1][0], chord.t1[1] - then.point[1][1],
                 chord.t1[2] - then.point[1][2]};
    return dot(n, d) / norm(n) + 2 * margin + 0x1p-40 * max_abs(d) < options.min_separation;
  };
  return search(margins, options.tolerance * margins.size, options.latest, reports, proves);
}

}  // namespace

Verdict turning_half_space_test(const VertexMotion& vertex, const Twist& twist,
                                const HalfSpaceMotion& half_space, const ElementaryOptions& options,
                                ElementaryCounts& counts) {
  return search_half_space(vertex, twist, half_space, options, counts);
}

Verdict turning_half_space_keep_distance(const VertexMotion& vertex, const Twist& twist,
                                         const HalfSpaceMotion& half_space, const KeepDistance& keep,
                                         const ElementaryOptions& options, ElementaryCounts& counts) {
  const double least = half_space_distance(vertex, half_space, Instant::kStart);
  if (!(least > keep.beyond)) return {true, ContactStatus::kOverlapAtStart, 0};
  const double own = keep.share * least + (1 - keep.share) * keep.beyond;
  ElementaryOptions of_pair = options;
  of_pair.min_separation = std::max(keep.beyond, own);
  of_pair.tolerance = std::min(
      options.tolerance, std::max(0x1p-40, 0x1p-7 * (least - of_pair.min_separation) /
                                               HalfSpaceChords(vertex, twist, half_space).margins().size));
  return search_half_space(vertex, twist, half_space, of_pair, counts);
}

Verdict turning_half_space_candidate(const VertexMotion& vertex, const Twist& twist,
                                     const HalfSpaceMotion& half_space, const ElementaryOptions& options,
                                     ElementaryCounts& counts) {
  ElementaryOptions widened = options;
  const Margins margins = HalfSpaceChords(vertex, twist, half_space).margins();
  widened.min_separation = finite_sum(options.min_separation, margins.of(1));
  return half_space_candidate(vertex, half_space, widened, counts);
}

std::array<double, 4> on_arc(const VertexMotion& vertex, const Twist& twist, double s) {
  if (s == 1) return vertex.t1;
  return Path(vertex, &twist, {}).at(s, shares_at(&twist, s));
}

}  // namespace warmfront
