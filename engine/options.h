// SPDX-License-Identifier: Apache-2.0
// What a caller may choose of a collider, and the defaults. Plain values, constant once a collider is built.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "engine/result.h"

namespace warmfront {

/// How an elementary test decides (DESIGN 4): the user's dial between speed and accuracy.
enum class Tier : std::uint8_t { kFast, kCertified, kExact };

/// What is kept of the bounding volume test tree between steps. All modes give the same contacts.
enum class FrontMode : std::uint8_t {
  kNone,   ///< nothing: traverse from the root each step (the paper's 4-stage baseline)
  kPaper,  ///< sprout only, deferred rebuild (Tang, Manocha, Tong 2009, section 4.3)
  kWarm,   ///< sprout and prune: the updated front equals the one built from scratch
};

/// Which moving bounding volume the hierarchy uses.
enum class BoundsKind : std::uint8_t {
  kAabb,
  kKDop18,
  kAuto,  ///< 18-DOP, unless the first steps test so little that the AABB is cheaper
};

/// What a step answers with.
enum class Report : std::uint8_t {
  kAll,  ///< every contact
  /// The contacts with the least toi of the step only (ties included); later work is pruned. With a
  /// separation, whatever starts nearer than it is in contact at 0, and nothing else is told: it answers "how
  /// far may I go" only from a state whose parts are all farther apart.
  kEarliest,
  kCount,  ///< how many, without the list
  /// Every pair whose moving bounds (18-DOPs, widened by min_separation) overlap at some time, before any
  /// elementary test: for those who bring their own. The tier does not matter; status kBudget, toi the
  /// earliest time that the bounds leave.
  kCandidates,
  /// Of intersections: whether there is any, which ends the search: their number is 0 or 1, without the list.
  kAny,
  /// Of proximity: how near each vertex is to anything, without the list; see StepResult::vertex_distances.
  kVertexDistances,
};

/// What is asked of each pair of features. Set by the question (question.h): a collider is created with
/// kMotion.
enum class PairTest : std::uint8_t {
  kMotion,        ///< do they meet, or come within min_separation, during the step?
  kProximity,     ///< are they within min_separation of each other at one instant?
  kIntersection,  ///< of an edge and a face without a common vertex: do they meet at one instant?
};

/// An instant of a motion.
enum class Instant : std::uint8_t { kStart, kEnd };

/// What is told of a contact besides its features, status and time; what is not asked for is not computed.
struct ContactFields {
  bool weights = false;    ///< barycentric coordinates of the closest points
  bool normal = false;     ///< of the face or of both edges: not the direction between the closest points
  bool points = false;     ///< the closest points themselves
  bool direction = false;  ///< from the second feature's closest point to the first's
  bool squared_distance = false;  ///< of the closest points
  bool closest = false;           ///< which features they are on: ClosestFeatures

  bool any() const { return weights || normal || points || direction || squared_distance || closest; }
  friend bool operator==(const ContactFields&, const ContactFields&) = default;
};

/// How the positions that a commit makes are rounded: see part_way().
enum class Rounding : std::uint8_t { kFloat64, kFloat32 };

struct ColliderOptions {
  Tier tier = Tier::kCertified;
  /// Certified tier: a pair may be reported when it comes this close, relative to the query's own size (the
  /// largest coordinate difference between its two primitives at either end of the step). In (0, 1]; rounding
  /// may add 2^-18: see elementary/certified.h.
  double tolerance = 1e-6;
  /// A pair is in contact when it comes within this distance, in the scene's length unit: at most this far in
  /// the exact tier. Finite, >= 0; 0 in the fast tier, which decides touching.
  double min_separation = 0.0;
  Report report = Report::kAll;
  ContactFields fields = {};
  /// Do not report what is within the separation (or not provably apart) at t = 0, ContactStatus
  /// kOverlapAtStart: it is counted in StepResult::overlaps_at_start alone.
  bool leave_out_overlaps = false;
  /// The question, and the instant of one without a motion: kProximity with report kAll, kCount or
  /// kVertexDistances, kIntersection with the first two and kAny.
  PairTest pair_test = PairTest::kMotion;
  Instant instant = Instant::kStart;
  /// Of kProximity with report kAll (of kCount it changes nothing): list each closest pair once, as barriers
  /// are summed. Of all rows with the same closest features (two vertices; an edge and a vertex; of two edges
  /// or a face and a vertex there is one row) the first stays, with their number: StepResult::closest_pairs.
  /// Mesh edges and vertices count, not the kind of row: a vertex may be nearest to an edge in a row of a
  /// face and in one of another edge. The answer's counts are of all rows, and so is max_contacts, because
  /// these are held until they are reduced; at most 2^32 - 1 are.
  ///
  /// Nearly parallel edges a and b, |a x b|^2 < 10^-3 |a|^2 |b|^2 where they are asked about, keep a row of
  /// their own, of all four vertices and multiplicity 1, whichever features are closest: barriers of such a
  /// pair are multiplied by a mollifier of its own, which goes to 0 with the angle and makes them smooth, so
  /// that it cannot be summed with others (Li et al. 2020, "Incremental Potential Contact", section 5). There
  /// the lengths on the right are those at rest; here those of the state, since a scene need not have a rest
  /// shape.
  bool reduced = false;
  /// Of Collider::max_step() alone, from its own options: see QuestionOptions::keep_distance.
  std::optional<double> keep_distance = std::nullopt;
  /// Of Collider::max_step() alone, not in the fast tier: no two features come nearer to each other than a
  /// commit that rounds so may take them. See CommitRoom.
  std::optional<Rounding> room_for = std::nullopt;
  /// Step an all-deformable collider beside this one, to say what the scene's model saves: see
  /// StepResult::all_deformable.
  bool explain = false;
  FrontMode front = FrontMode::kWarm;
  /// `warm` mode: do not look at pairs that cannot have come together since they were last tested.
  bool lazy_front = true;
  BoundsKind bounds = BoundsKind::kAuto;
  /// Where the scene declares no bodies: take its components for bodies, so that what rests, and pairs that
  /// are far apart, cost nothing.
  bool find_bodies = true;
  /// Find bodies that move rigidly, and test them against themselves only where that could change an answer
  /// (tiers certified and exact).
  bool find_rigid = true;
  /// Look for a plane between small bodies that are near each other, which spares them every other test
  /// (tiers certified and exact). A matter of speed only.
  bool separate_parts = true;
  /// Exact tier: skip self-collision of flat patches by normal cone and contour test, which rule out meeting
  /// and no nearness. Off, because since bounds ask for relative motion it costs more than it saves.
  bool normal_cones = false;
  /// Most triangles a leaf of the hierarchy holds: a power of two, 64 at most. Above 8 they are in blocks of
  /// 8, which are tested eight against one.
  std::uint32_t leaf_size = 64;
  /// `paper` mode: rebuild the front after this many steps in a row in which it did not grow. 0: never.
  std::uint32_t rebuild_after_stalled_steps = 3;
  /// `paper` mode: rebuild the front every this many steps. 0: never.
  std::uint32_t rebuild_every_steps = 0;
  /// Above this many bytes the front is dropped and steps traverse from the root, with the same answer. What
  /// is kept of stationary parts counts, too: without room for it they are tested again in every step. The
  /// front's lists of near pairs of bodies may take a quarter of it (some 350 bytes a pair): of more, and of
  /// more than 65,536, no front is kept. Where bodies that turn by much are during a step may take another
  /// quarter: what it has no room for is computed again each time that it is needed.
  std::size_t max_front_bytes = std::size_t{4} << 30;
  /// A step with more contacts than this fails with kResourceExhausted (report kAll and kEarliest).
  std::size_t max_contacts = 50'000'000;

  friend bool operator==(const ColliderOptions&, const ColliderOptions&) = default;
};

/// Are only pairs reported that come as near as the tier says? Then others may be left out by their distance:
/// not in tier fast, nor of candidates.
inline bool reports_by_distance(const ColliderOptions& options) {
  return options.tier != Tier::kFast && options.report != Report::kCandidates;
}

/// Checks the ranges stated above and names the first field out of range.
Status validate(const ColliderOptions& options);

/// May a collider with these options have the others from now on? Which hierarchies it has is decided when it
/// is created: kInvalidArgument, naming the field, where `bounds`, `find_bodies`, `leaf_size`, `normal_cones`
/// or `explain` differ.
Status check_may_become(const ColliderOptions& options, const ColliderOptions& others);
/// Do they keep the same between steps?
bool keep_alike(const ColliderOptions& options, const ColliderOptions& others);

/// The names used on command lines, on the wire's text forms and in JSON: "certified", "warm", "kdop18",
/// "all", ...
std::string_view to_string(Tier tier);
std::string_view to_string(FrontMode mode);
std::string_view to_string(BoundsKind kind);
std::string_view to_string(Report report);
Result<Tier> parse_tier(std::string_view name);
Result<FrontMode> parse_front_mode(std::string_view name);
Result<BoundsKind> parse_bounds_kind(std::string_view name);
Result<Report> parse_report(std::string_view name);

}  // namespace warmfront
