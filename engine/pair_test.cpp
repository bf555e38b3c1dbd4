// SPDX-License-Identifier: Apache-2.0
#include "engine/pair_test.h"

#include <cmath>
#include <string>

#include "engine/elementary/elementary_test.h"
#include "engine/elementary/keep_distance.h"
#include "engine/narrow_phase/coplanarity_filter.h"
#include "engine/narrow_phase/separation_filter.h"
#include "engine/parallel/default_environment.h"

namespace warmfront {
namespace {

/// Of keep_distance in tier exact: no number of a pair's own is decided without error.
constexpr double kFine = 0x1p-32;

Status check_options(const PairOptions& options) {
  if (options.tier != Tier::kFast && options.tier != Tier::kCertified && options.tier != Tier::kExact)
    return invalid_argument("tier: is none of fast, certified and exact");
  if (!(options.keep_distance >= 0 && options.keep_distance < 1))
    return invalid_argument("keep_distance: is not in [0, 1)");
  if (!(options.latest >= 0 && options.latest <= 1)) return invalid_argument("latest: is not in [0, 1]");
  ColliderOptions as_asked{
      .tier = options.tier, .tolerance = options.tolerance, .min_separation = options.min_separation};
  if (options.keep_distance > 0) as_asked.keep_distance = options.keep_distance;
  return validate(as_asked);
}

bool all_finite(const std::array<std::array<double, 3>, 4>& positions) {
  double sum = 0;
  for (const auto& position : positions)
    for (const double x : position) sum += x * 0;
  return sum == 0;
}

Error not_finite(const MovingPair& pair) {
  for (std::size_t v = 0; v < 4; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool at_start = !std::isfinite(pair.start[v][axis]);
      if (at_start || !std::isfinite(pair.end[v][axis]))
        return invalid_argument(std::string(at_start ? "start" : "end") + ": vertex " + std::to_string(v) +
                                ", " + "xyz"[axis] + " is not finite");
    }
  }
  return {ErrorCode::kInternal, "positions: all are finite"};
}

using Vertices = std::array<VertexMotion, 4>;

Vertices motions_of(const MovingPair& pair) {
  Vertices vertices{};
  for (std::size_t v = 0; v < 4; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      vertices[v].t0[axis] = pair.start[v][axis];
      vertices[v].t1[axis] = pair.end[v][axis];
    }
  }
  return vertices;
}

// The filters of many pairs are part of a tier's answer: of this one.
bool passes_filters(ContactKind kind, const Vertices& vertices, double separation) {
  const FeaturePair pair{{0, 1, 2, 3}, 0, 1, kind};
  const std::span<const FeaturePair> one(&pair, 1);
  const std::span<const double> separations(&separation, separation > 0 ? 1 : 0);
  std::uint16_t survivor = 0;
  const std::size_t count = coplanarity_filter(one, vertices, separations, &survivor);
  return separation > 0 ? count > 0 : separation_filter(one, vertices, &survivor, count) > 0;
}

Verdict verdict_of(ContactKind kind, const Vertices& vertices, const PairOptions& options) {
  const FeatureVertices features{kind, {&vertices[0], &vertices[1], &vertices[2], &vertices[3]}};
  if (options.keep_distance > 0)
    return keep_distance_test(
        features, {options.keep_distance, options.min_separation},
        {.tolerance = options.tier == Tier::kExact ? kFine : options.tolerance, .latest = options.latest});
  if (!passes_filters(kind, vertices, options.min_separation)) return {};
  ElementaryCounts counts;
  return elementary_test(features,
                         {.tier = options.tier,
                          .tolerance = options.tolerance,
                          .min_separation = options.min_separation,
                          .latest = options.latest},
                         counts);
}

}  // namespace

Result<std::optional<PairContact>> test_pair(const MovingPair& pair, const PairOptions& options) {
  if (pair.kind != ContactKind::kVertexFace && pair.kind != ContactKind::kEdgeEdge)
    return invalid_argument("kind: is neither vertex-face nor edge-edge");
  if (Status valid = check_options(options); !valid) return valid.error();
  const DefaultEnvironment environment(DefaultEnvironment::Set::kWhereItIsNot);
  if (!all_finite(pair.start) || !all_finite(pair.end)) return not_finite(pair);
  const Verdict verdict = verdict_of(pair.kind, motions_of(pair), options);
  if (!verdict.contact || verdict.toi > options.latest) return std::optional<PairContact>();
  return std::optional<PairContact>({verdict.status, verdict.toi});
}

}  // namespace warmfront
