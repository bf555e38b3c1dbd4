// SPDX-License-Identifier: Apache-2.0
// A step's answer, owned and free of the collider that made it. Immutable once made, so free to share between
// threads.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/collider.h"
#include "server/session/account.h"
#include "server/session/state_digest.h"

namespace warmfront::server {

struct Answer : KindCounts {
  std::uint64_t frame = 0;
  std::uint64_t possible = 0;
  std::optional<double> earliest_toi;
  StepStatistics statistics;
  SessionState state;         ///< of the session after the frame, ...
  SessionState state_before;  ///< ... and the one that it was stepped from; of a trial the same
  /// Of a question that leaves them out; see StepResult.
  std::uint64_t overlaps_at_start = 0;
  /// Of a question for a step length that keeps a share of each pair's distance.
  std::optional<double> keep_distance;
  /// Of a commit: vf, ee and possible are of the contacts that the trial listed; where not, they are not
  /// known.
  bool commit_counted = false;
  double queue_ms = 0;  ///< between the frame's arrival and its step
  /// What the frame would have taken with everything deformable, when that was asked for.
  struct AllDeformable {
    StepStatistics statistics;
    std::size_t frame_bytes = 0;
    std::size_t positions_bytes = 0;
  };
  std::optional<AllDeformable> all_deformable;
  // Columns of equal length, in the engine's order.
  std::vector<std::uint8_t> kind;
  std::vector<std::uint8_t> status;
  std::vector<std::array<std::uint32_t, 4>> vertices;
  std::vector<double> toi;
  /// Of intersections, whose `vertices` are empty.
  std::vector<std::array<std::uint32_t, 5>> edge_faces;
  // Those that were asked for.
  std::vector<std::array<double, 4>> weights;
  std::vector<std::array<double, 3>> normal;
  std::vector<std::array<double, 6>> points;
  std::vector<std::array<double, 3>> direction;
  std::vector<double> squared_distance;
  std::vector<std::uint8_t> closest;
  // Of a reduced answer; see ClosestPair.
  std::vector<std::uint32_t> multiplicity;
  std::vector<std::uint8_t> stencil;
  /// Of a question for distances by vertex, which has no rows.
  std::vector<double> vertex_distances;
  /// Of Report::kEarliest in a scene with worlds; see StepResult.
  std::vector<std::uint32_t> worlds;
  std::vector<double> world_tois;
  /// On the session's account for as long as anyone has the answer: the session, or a stream that sends it.
  Holding memory;

  std::size_t rows() const { return kind.size(); }
  std::uint64_t pairs() const { return total(); }
  std::size_t memory_bytes() const { return sizeof(*this) + contact_bytes(); }
  /// In memory and on the wire.
  std::size_t bytes_per_row() const {
    return kBytesPerRow + (weights.empty() ? 0 : 32) + (normal.empty() ? 0 : 24) + (points.empty() ? 0 : 48) +
           (direction.empty() ? 0 : 24) + (squared_distance.empty() ? 0 : 8) + (closest.empty() ? 0 : 1) +
           (edge_faces.empty() ? 0 : kMoreOfEdgeFace) + (multiplicity.empty() ? 0 : kMoreOfReduced);
  }
  std::size_t contact_bytes() const {
    return rows() * bytes_per_row() + vertex_distances.size() * sizeof(double) +
           worlds.size() * kBytesPerWorld;
  }

  static constexpr std::size_t kBytesPerRow = 1 + 1 + 16 + 8;  ///< of the columns that are always there
  static constexpr std::size_t kMoreOfEdgeFace = 4;            ///< five vertices instead of four
  static constexpr std::size_t kBytesPerWorld = 4 + 8;         ///< its number and toi
  static constexpr std::size_t kMoreOfReduced = 4 + 1;         ///< multiplicity and stencil
};

/// Contact bytes of an answer, in memory and on the wire.
std::size_t contact_bytes(const StepResult& result, const ContactFields& fields);

/// The most that a session holds for one contact of a step, from its being found until its answer is sent,
/// what a front keeps of it apart. `reduced`: before it is found to be the same closest pair as another.
std::size_t held_per_contact(const ContactFields& fields, bool reduced = false);

/// The most contacts that a step may have, so that they take up no more than the part of `max_session_bytes`
/// that is theirs. At least 1.
std::size_t most_contacts(std::size_t max_session_bytes, bool explain, const ContactFields& fields,
                          bool reduced = false);
/// That part: of the two parts of a session that grow with its motion, its front is the other. What runs
/// beside it to explain takes its part of that.
std::size_t growing_part(std::size_t max_session_bytes, bool explain);

Answer make_answer(std::uint64_t frame, const Scene& scene, const StepResult& result,
                   const ContactFields& fields);

}  // namespace warmfront::server
