// SPDX-License-Identifier: Apache-2.0
#include "engine/options.h"

#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

#include "engine/digits.h"

namespace warmfront {
namespace {

template <class T, std::size_t N>
using Names = std::array<std::pair<T, std::string_view>, N>;

constexpr Names<Tier, 3> kTiers{
    {{Tier::kFast, "fast"}, {Tier::kCertified, "certified"}, {Tier::kExact, "exact"}}};
constexpr Names<FrontMode, 3> kFronts{
    {{FrontMode::kNone, "none"}, {FrontMode::kPaper, "paper"}, {FrontMode::kWarm, "warm"}}};
constexpr Names<BoundsKind, 3> kBounds{
    {{BoundsKind::kAabb, "aabb"}, {BoundsKind::kKDop18, "kdop18"}, {BoundsKind::kAuto, "auto"}}};
constexpr Names<Report, 6> kReports{{{Report::kAll, "all"},
                                     {Report::kEarliest, "earliest"},
                                     {Report::kCount, "count"},
                                     {Report::kCandidates, "candidates"},
                                     {Report::kAny, "any"},
                                     {Report::kVertexDistances, "vertex-distances"}}};

template <class T, std::size_t N>
std::string_view name_of(const Names<T, N>& names, T value) {
  for (const auto& [known, name] : names) {
    if (known == value) return name;
  }
  return "unknown";
}

template <class T, std::size_t N>
Result<T> value_of(const Names<T, N>& names, std::string_view field, std::string_view name) {
  std::string choices;
  for (const auto& [value, known] : names) {
    if (known == name) return value;
    choices += (choices.empty() ? "" : ", ") + std::string(known);
  }
  return invalid_argument(std::string(field) + ": \"" + std::string(name) + "\" is not one of " + choices);
}

}  // namespace

std::string_view to_string(Tier tier) {
  return name_of(kTiers, tier);
}
std::string_view to_string(FrontMode mode) {
  return name_of(kFronts, mode);
}
std::string_view to_string(BoundsKind kind) {
  return name_of(kBounds, kind);
}
std::string_view to_string(Report report) {
  return name_of(kReports, report);
}
Result<Tier> parse_tier(std::string_view name) {
  return value_of(kTiers, "tier", name);
}
Result<FrontMode> parse_front_mode(std::string_view name) {
  return value_of(kFronts, "front", name);
}
Result<BoundsKind> parse_bounds_kind(std::string_view name) {
  return value_of(kBounds, "bounds", name);
}
Result<Report> parse_report(std::string_view name) {
  return value_of(kReports, "report", name);
}

Status validate(const ColliderOptions& options) {
  if (!(options.tolerance > 0.0 && options.tolerance <= 1.0)) {
    return invalid_argument("tolerance: " + digits_of(options.tolerance) + " is not in (0, 1]");
  }
  if (!(options.min_separation >= 0.0 && std::isfinite(options.min_separation))) {
    return invalid_argument("min_separation: " + digits_of(options.min_separation) +
                            " is not a finite length >= 0");
  }
  const std::uint32_t leaf = options.leaf_size;
  if (!std::has_single_bit(leaf) || leaf > 64) {
    return invalid_argument("leaf_size: " + std::to_string(leaf) + " is not one of 1, 2, 4, 8, 16, 32, 64");
  }
  const bool of_motion = options.report == Report::kEarliest || options.report == Report::kCandidates;
  if (options.pair_test != PairTest::kMotion && of_motion) {
    return invalid_argument("report: \"" + std::string(to_string(options.report)) +
                            "\" is of motions; without one use \"all\" or \"count\"");
  }
  if (options.report == Report::kAny && options.pair_test != PairTest::kIntersection) {
    return invalid_argument("report: \"any\" is of intersections; use \"all\" or \"count\"");
  }
  if (options.report == Report::kVertexDistances && options.pair_test != PairTest::kProximity) {
    return invalid_argument("report: \"vertex-distances\" is of proximity; use \"all\" or \"count\"");
  }
  if (options.reduced && options.pair_test != PairTest::kProximity) {
    return invalid_argument("reduced: it is of proximity alone; leave it out");
  }
  if (options.reduced && options.report == Report::kVertexDistances) {
    return invalid_argument(
        "reduced: report \"vertex-distances\" lists no pairs; leave it out, or use \"all\"");
  }
  if (options.min_separation > 0 && options.tier == Tier::kFast) {
    return invalid_argument(
        "min_separation: tier \"" + std::string(to_string(options.tier)) +
        "\" decides touching; for a separation above 0 use tier \"certified\" or \"exact\"");
  }
  if (options.keep_distance) {
    if (!(*options.keep_distance > 0.0 && *options.keep_distance < 1.0))
      return invalid_argument("keep_distance: " + digits_of(*options.keep_distance) + " is not in (0, 1)");
    if (options.tier == Tier::kFast)
      return invalid_argument(
          "keep_distance: tier \"fast\" decides touching; to keep a distance use tier \"certified\" or "
          "\"exact\"");
  }
  return {};
}

Status check_may_become(const ColliderOptions& options, const ColliderOptions& others) {
  const auto fixed = [](std::string_view field) {
    return invalid_argument(std::string(field) + ": is fixed when a collider is created; leave it as it is");
  };
  if (options.bounds != others.bounds) return fixed("bounds");
  if (options.find_bodies != others.find_bodies) return fixed("find_bodies");
  if (options.leaf_size != others.leaf_size) return fixed("leaf_size");
  if (options.normal_cones != others.normal_cones) return fixed("normal_cones");
  if (options.explain != others.explain) return fixed("explain");
  return validate(others);
}

bool keep_alike(const ColliderOptions& options, const ColliderOptions& others) {
  const auto of = [](const ColliderOptions& o) {
    return std::tie(o.front, o.lazy_front, o.find_rigid, o.separate_parts, o.rebuild_after_stalled_steps,
                    o.rebuild_every_steps, o.max_front_bytes);
  };
  return of(options) == of(others);
}

}  // namespace warmfront
