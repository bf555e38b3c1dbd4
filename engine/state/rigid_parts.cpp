// SPDX-License-Identifier: Apache-2.0
#include "engine/state/rigid_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/elementary/certified.h"
#include "engine/motion/least_stretch.h"
#include "engine/motion/longest_way.h"
#include "engine/motion/trial_way.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/primitives.h"

namespace warmfront {
namespace {

/// The clearances to be shown, as shares of the mean edge: a part that fails one is measured again for the
/// next.
constexpr std::array<double, 4> kLadder{1.0 / 8, 1.0 / 32, 1.0 / 128, 1.0 / 512};
/// A part that does not move rigidly is looked at ever more seldom, up to this many steps apart.
constexpr std::uint32_t kMostBackoff = 256;
/// Primitives that one step measures, or else one part: a crowd does not make a step as long as the first.
constexpr std::size_t kMeasuredAtOnce = 20'000;

// At t = 0.
double edge_length(const Scene& scene, EdgeId edge, std::span<const VertexMotion> vertices) {
  const auto& a = vertices[ends_of(scene, edge)[0]].t0;
  const auto& b = vertices[ends_of(scene, edge)[1]].t0;
  return length_above(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Of the edges at t = 0.
RigidParts::EdgeLengths edge_lengths(const Scene& scene, const FeatureRange& features,
                                     std::span<const VertexMotion> vertices, StopSignal stop) {
  // The sum is that of the pieces' sums in order, for any number of threads.
  constexpr std::uint32_t kPiece = 4096;
  const std::uint32_t edges = features.end_edge - features.first_edge;
  std::vector<RigidParts::EdgeLengths> pieces((edges + kPiece - 1) / kPiece);
  const auto add_piece = [&](std::size_t p) {
    const EdgeId first = features.first_edge + static_cast<std::uint32_t>(p) * kPiece;
    RigidParts::EdgeLengths& piece = pieces[p];
    for (EdgeId e = first; e < std::min(first + kPiece, features.end_edge); ++e) {
      const double length = edge_length(scene, e, vertices);
      piece.mean += length;
      piece.longest = std::max(piece.longest, length);
    }
  };
  for_each_index(0, pieces.size(), stop, add_piece, 1);
  RigidParts::EdgeLengths lengths;
  for (const RigidParts::EdgeLengths& piece : pieces) {
    lengths.mean += piece.mean;
    lengths.longest = std::max(lengths.longest, piece.longest);
  }
  if (features.end_edge > features.first_edge) lengths.mean /= features.end_edge - features.first_edge;
  return lengths;
}

// How linear maps take distances of the reference from one fit to the next: none, at any time of the motion,
// to less than kLeastStretch of itself, ...
struct Spread {
  double longest;  // ... none, at either end, to more than this times itself, ...
  double motion;   // ... and no difference of two points goes farther than this times itself.
};

// None where that is not proved.
std::optional<Spread> spread_between(const RigidReference::Fit& from, const RigidReference::Fit& to) {
  if (from.turned && to.turned) {
    const double cosine = cosine_between(from.linear, to.linear);
    if (!(cosine >= 0)) return std::nullopt;
    // A chord's square is 2 - 2 cosine, of which rounding takes some 2^-49.
    return Spread{1, std::sqrt(2 * std::max(0.0, 1 - cosine) + 0x1p-46)};
  }
  if (!remains_spread(from.linear, to.linear)) return std::nullopt;
  double square = 0;
  for (std::size_t k = 0; k < from.linear.size(); ++k) {
    const double difference = to.linear[k] - from.linear[k];
    square += difference * difference;
  }
  return Spread{kMostStretch, std::sqrt(square + 0x1p-46)};
}

// May nothing within the part be reported, if it moves from one fit to the next? Where the tier may report
// what is near, by its promise of certified.h (kSurelyDecided): pairs stay farther apart than it reports at,
// and what they have beyond that separation is not too little beside how they move. The same where two
// vertices end up to `room` farther from each other, or nearer, than they do.
bool apart(const RigidParts::EdgeLengths& edges, double clearance, const RigidReference::Fit& from,
           const RigidReference::Fit& to, const ColliderOptions& options, double separation, double room) {
  const std::optional<Spread> spread = spread_between(from, to);
  if (!spread) return false;
  const double off = 2 * std::max(from.residual, to.residual) + room;
  const double gap = kLeastStretch * clearance - off;
  // kLeastStretch leaves half a hundredth of the clearance for rounding.
  if (options.tier == Tier::kExact) return gap > separation;
  // What the certified tier may report at, of pairs at the clearance, which are no larger than two edges and
  // the clearance; of pairs farther apart the gap grows faster than the size.
  const double share = certified_reach(options.tolerance);
  const double size_at_rest = 2 * edges.longest + clearance;
  const double size = spread->longest * size_at_rest + 3 * off;
  const double motion = spread->motion * (size_at_rest + 3 * off) + 2 * off;
  const double beyond = gap - separation;
  return share < 0.5 * kLeastStretch / spread->longest && beyond > share * size &&
         motion < kSurelyDecided * beyond;
}

// By a rotation, or else by any linear map.
RigidReference::Fit fit(const RigidReference& reference, std::span<const VertexMotion> vertices, bool start,
                        double limit, StopSignal stop) {
  const RigidReference::Fit turned = reference.fit(vertices, start, limit, stop);
  return turned.residual <= limit ? turned : reference.fit_between(vertices, start, limit, stop);
}

// How far off a fit of a part's vertices may be that counts, where its clearance is as long as this.
double off_limit(double clearance) {
  return 0.25 * kLeastStretch * clearance;
}

// Does a few vertices' motion show that no fit will do? Most of what deforms shows it so, and needs no
// reference. By far: the fit of a few has other anchors than that of all, and their edges another mean.
bool few_deform(const Scene& scene, const FeatureRange& features, std::span<const VertexMotion> all,
                StopSignal stop) {
  constexpr std::uint32_t kFew = 64;
  constexpr double kFar = 8;
  const std::uint32_t vertices = features.end_vertex - features.first_vertex;
  const std::uint32_t edges = features.end_edge - features.first_edge;
  if (vertices < 4 * kFew || edges < 4 * kFew) return false;
  std::vector<VertexMotion> few;
  few.reserve(kFew);
  double length = 0;
  for (std::uint32_t k = 0; k < kFew; ++k) {
    few.push_back(all[features.first_vertex + std::uint64_t{k} * vertices / kFew]);
    const auto edge = features.first_edge + static_cast<std::uint32_t>(std::uint64_t{k} * edges / kFew);
    length += edge_length(scene, edge, all);
  }
  const double limit = kFar * off_limit(kLadder[0] * length / kFew);
  const RigidReference reference(few, stop);
  return !reference.flat() && !(fit(reference, few, false, limit, stop).residual <= limit);
}

}  // namespace

void RigidParts::take(const CollisionModel& model) noexcept {
  for (std::uint32_t p = 0; p < model.part_count(); ++p) {
    if (!model.self_collision(PartId{p})) parts_[p] = {};
  }
}

void RigidParts::give_up(Part& part) {
  const std::uint32_t backoff = std::min(2 * part.backoff, kMostBackoff);
  const std::uint32_t wait = part.backoff;
  const std::uint32_t interruptions = part.interruptions;
  part = {};
  part.backoff = backoff;
  part.wait = wait;
  part.interruptions = interruptions;
}

void RigidParts::look_at(Part& part, const PartTopology& topology, const Scene& scene,
                         const SceneMotion& motion, MotionState state, const ColliderOptions& options,
                         double separation, bool trial, StopSignal stop) {
  const bool from_start = motion.from() == From::kStart;
  if ((state & kMoving) == 0) {  // it rests where motions begin: where the last began, or where that ended
    if (from_start)
      part.at_end = part.at_start;
    else
      part.at_start = part.at_end;
    return;
  }
  part.rigid = false;
  if (part.wait > 0) {
    --part.wait;
    part.follows = false;
    return;
  }
  const FeatureRange& features = topology.features;
  const std::span<const VertexMotion> all = motion.vertices().vertices();
  const auto vertices = all.subspan(features.first_vertex, features.end_vertex - features.first_vertex);
  if (part.reference == nullptr) {
    if (!trial && few_deform(scene, features, all, stop)) return give_up(part);
    part.edges = edge_lengths(scene, features, all, stop);
    part.reference = std::make_unique<RigidReference>(vertices, stop);
    part.follows = false;
  }
  const double shown = part.clearance.value_or(kLadder[part.rung] * part.edges.mean);
  const double limit = off_limit(shown);
  if (!part.follows)
    part.at_start = fit(*part.reference, vertices, true, limit, stop);
  else if (!from_start)
    part.at_start = part.at_end;
  part.at_end = fit(*part.reference, vertices, false, limit, stop);
  if (!(std::max(part.at_start.residual, part.at_end.residual) <= limit)) {
    // What a trial deforms need not deform when it moves.
    if (trial && part.at_start.residual <= limit)
      part.follows = true;
    else
      give_up(part);
    return;
  }
  const Motion& moves = motion.vertices();
  const double room = trial ? moves.frame().to_scene(kPairBesideTheWay * moves.magnitude()) : 0;
  part.rigid = part.clearance &&
               apart(part.edges, *part.clearance, part.at_start, part.at_end, options, separation, room);
  part.follows = true;
  ++part.fitted;
}

void RigidParts::look(const Topology& topology, const SceneMotion& motion, const CollisionModel& model,
                      const ColliderOptions& options, const Thickness& thickness,
                      const std::shared_ptr<Workers>& workers, BodiesWithin bodies_within, bool trial,
                      StopSignal stop) {
  count_ = 0;
  if (!options.find_rigid || !reports_by_distance(options) || options.pair_test == PairTest::kIntersection)
    return;
  fork_each(std::uint32_t{0}, model.part_count(), [&](std::uint32_t p) {
    stop.check();
    if (model.self_collision(PartId{p}))
      look_at(parts_[p], topology.parts[p], topology.scene, motion, motion.state(PartId{p}), options,
              thickness.between(options.min_separation, PartId{p}, PartId{p}), trial, stop);
  });
  for (const Part& part : parts_) count_ += part.rigid ? 1 : 0;
  const std::vector<PartId> parts = due(topology, motion);
  if (!parts.empty()) measure(parts, topology, workers, bodies_within, stop);
}

void RigidParts::postpone(Part& part) {
  constexpr std::uint32_t kMostDoublings = 22;
  part.wait = kMostBackoff << std::min(part.interruptions, kMostDoublings);
  ++part.interruptions;
}

double RigidParts::wanted_clearance(PartId part) const {
  return kLadder[parts_[number_of(part)].rung] * parts_[number_of(part)].edges.mean;
}

// Of about one size: those of much longer edges would be measured by too short a length, and wait.
std::vector<PartId> RigidParts::due(const Topology& topology, const SceneMotion& motion) const {
  std::vector<PartId> due;
  double least = std::numeric_limits<double>::infinity();
  // There may be room for more: for a body whose addition failed.
  const auto part_count = static_cast<std::uint32_t>(topology.parts.size());
  for (std::uint32_t p = 0; p < part_count; ++p) {
    const Part& part = parts_[p];
    const bool looked_at = part.wait == 0 && (motion.state(PartId{p}) & kMoving) != 0;
    if (!looked_at || part.fitted < kSteps || part.clearance) continue;
    due.push_back(PartId{p});
    least = std::min(least, wanted_clearance(PartId{p}));
  }
  std::erase_if(due, [&](PartId p) { return wanted_clearance(p) > 4 * least; });
  std::size_t primitives = 0;
  const auto enough = std::ranges::find_if(due, [&](PartId p) {
    primitives += topology.parts[number_of(p)].order.size();
    return primitives > kMeasuredAtOnce && p != due.front();
  });
  due.erase(enough, due.end());
  return due;
}

// The references side by side, none tested against another.
void RigidParts::measure(std::span<const PartId> parts, const Topology& topology,
                         const std::shared_ptr<Workers>& workers, BodiesWithin bodies_within,
                         StopSignal stop) {
  for (const PartId p : parts) postpone(parts_[number_of(p)]);  // in case this ends before its time
  double clearance = std::numeric_limits<double>::infinity();
  for (const PartId p : parts) clearance = std::min(clearance, wanted_clearance(p));
  SceneDescription description;
  std::vector<double> positions;
  for (const PartId p : parts) {
    const PartTopology& from = topology.parts[number_of(p)];
    Body body;
    body.first_vertex = description.vertex_count;
    body.vertex_count = from.features.end_vertex - from.features.first_vertex;
    body.group = 1;
    body.mask = 2;
    for (const Primitive primitive : from.order) {
      const Face vertices = primitive_vertices(topology.scene, primitive);
      std::array<std::int32_t, 3> in_description;
      for (int k = 0; k < 3; ++k)
        in_description[k] =
            static_cast<std::int32_t>(vertices[k] - from.features.first_vertex + body.first_vertex);
      if (is_face(primitive)) description.faces.push_back(in_description);
      if (is_segment(primitive)) description.edges.push_back({in_description[0], in_description[1]});
    }
    description.vertex_count += body.vertex_count;
    description.bodies.push_back(body);
    const std::span<const double> reference = parts_[number_of(p)].reference->positions();
    positions.insert(positions.end(), reference.begin(), reference.end());
  }
  // A failure, of which there is none to expect but too many contacts, shows no clearance.
  std::vector<std::uint8_t> meets(parts.size(), 1);
  if (Result<Scene> scene = Scene::create(std::move(description)); scene) {
    const auto shared = std::make_shared<const Scene>(std::move(scene).value());
    if (const auto near = bodies_within(shared, positions, clearance, workers, stop)) {
      std::ranges::fill(meets, std::uint8_t{0});
      for (const std::uint32_t body : *near) meets[body] = 1;
    }
  }
  stop.check();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    Part& part = parts_[number_of(parts[i])];
    part.wait = part.interruptions = 0;
    if (meets[i] == 0) {
      part.clearance = clearance;
    } else if (++part.rung == static_cast<int>(kLadder.size())) {
      give_up(part);
      part.backoff = part.wait = kMostBackoff;
    }
  }
}

void RigidParts::lose_track() noexcept {
  for (Part& part : parts_) part.follows = false;
}

void RigidParts::lose_track(std::span<const std::uint8_t> marked) noexcept {
  lose_track();
  const std::size_t parts = std::min(parts_.size(), marked.size());  // there may be room for more
  for (std::size_t p = 0; p < parts; ++p) {
    if (marked[p] != 0) parts_[p].rigid = false;
  }
}

void RigidParts::lose_rounded(const SceneMotion& motion) noexcept {
  const std::size_t parts = std::min<std::size_t>(parts_.size(), motion.part_count());
  for (std::uint32_t p = 0; p < parts; ++p) {
    if ((motion.state(PartId{p}) & kMoving) != 0 || motion.turns(PartId{p})) parts_[p].rigid = false;
  }
}

void RigidParts::undo() noexcept {
  for (Part& part : parts_) {
    part.follows = false;
    part.rigid = false;
  }
  count_ = 0;
}

std::size_t RigidParts::memory_bytes() const {
  std::size_t bytes = parts_.capacity() * sizeof(Part);
  for (const Part& part : parts_) {
    if (part.reference != nullptr) bytes += sizeof(RigidReference) + part.reference->memory_bytes();
  }
  return bytes;
}

}  // namespace warmfront
