// SPDX-License-Identifier: Apache-2.0
// A daemon's answers as plain values: free to copy between threads.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/contact.h"
#include "engine/options.h"
#include "engine/question.h"
#include "engine/statistics.h"

namespace warmfront::client {

/// Contacts as columns of equal length, in the engine's order.
struct ContactTable {
  std::vector<ContactKind> kind;
  std::vector<ContactStatus> status;
  /// The vertex, then the face's three (vertex-face); edge a's two, then edge b's two (edge-edge); the vertex
  /// three times, then the body's number (vertex-half-space). See Scene::vertices_of().
  std::vector<std::array<std::uint32_t, 4>> vertices;
  /// Of intersections, whose `vertices` are empty: the edge's two, then the face's three.
  std::vector<std::array<std::uint32_t, 5>> edge_faces;
  std::vector<double> toi;  ///< in [0, 1]; see Contact
  // Only with the matching ColliderOptions::fields; see ContactGeometry.
  std::vector<std::array<double, 4>> weights;
  std::vector<std::array<double, 3>> normal;
  std::vector<std::array<double, 6>> points;
  std::vector<std::array<double, 3>> direction;
  std::vector<double> squared_distance;
  std::vector<ClosestFeatures> closest;
  // Of a reduced answer; see ClosestPair.
  std::vector<std::uint32_t> multiplicity;
  std::vector<std::uint8_t> stencil;

  std::size_t size() const { return kind.size(); }
  /// Of a row, what was asked for; the rest is as ContactGeometry has it by default.
  ContactGeometry geometry(std::size_t row) const {
    ContactGeometry one;
    if (!weights.empty()) one.weights = weights[row];
    if (!normal.empty()) one.normal = normal[row];
    if (!points.empty()) one.points = points[row];
    if (!direction.empty()) one.direction = direction[row];
    if (!squared_distance.empty()) one.squared_distance = squared_distance[row];
    if (!closest.empty()) one.closest = closest[row];
    return one;
  }
  /// Of a row: of an answer that is not reduced, itself.
  ClosestPair closest_pair(std::size_t row) const {
    return multiplicity.empty() ? ClosestPair() : ClosestPair{multiplicity[row], stencil[row]};
  }
  bool has_geometry() const {
    return !weights.empty() || !normal.empty() || !points.empty() || !direction.empty() ||
           !squared_distance.empty() || !closest.empty();
  }
  friend bool operator==(const ContactTable&, const ContactTable&) = default;
};

/// Cost of sending a frame and receiving its answer, besides the step itself.
struct Travel {
  double encode_ms = 0;              ///< the frame to messages, in this process
  double decode_ms = 0;              ///< the answer's messages to columns, in this process
  double queue_ms = 0;               ///< in the daemon, between the frame's arrival and its step
  std::uint64_t sent_bytes = 0;      ///< of the frame's messages, resent ones included
  std::uint64_t received_bytes = 0;  ///< of the answer's messages
};

/// Cost of the same step and frame with everything deformable.
struct AllDeformable {
  StepStatistics statistics;
  std::uint64_t frame_bytes = 0;      ///< of the frame as sent
  std::uint64_t positions_bytes = 0;  ///< of a frame with all positions
};

/// One frame's answer: the same bits as from a collider in this process.
struct Answer : KindCounts {
  std::uint64_t frame = 0;
  std::uint64_t possible = 0;          ///< of vf, ee and vh, those neither proved nor excluded
  std::optional<double> earliest_toi;  ///< least toi of the step; none without contacts
  ContactTable contacts;               ///< empty for Report::kCount, and of a commit
  /// Left out by a question that leaves them out.
  std::uint64_t overlaps_at_start = 0;
  /// Of vertex_distances(), by vertex; see StepResult.
  std::vector<double> vertex_distances = {};
  /// Of Report::kEarliest in a scene with worlds; see StepResult.
  std::vector<std::uint32_t> worlds = {};
  std::vector<double> world_tois = {};
  std::optional<CommitResult> commit;  ///< of a commit, which has nothing else to tell
  StepStatistics statistics;
  std::optional<AllDeformable> all_deformable;  ///< with options.explain
  Travel travel;
};

/// How far a motion may go; see warmfront::MaxStep.
struct MaxStep {
  /// In [0, 1]: nothing touches, or comes within the separation, or nearer than a commit rounds
  /// (Collider::max_step()), before it. 1 where nothing does at all.
  double fraction = 1;
  /// Pairs that are within the separation, or nearer than a commit rounds, or not provably apart, at the
  /// start: counted whether they are left out or not. Where they are not, any that comes nearer makes
  /// `fraction` 0.
  std::uint64_t overlaps_at_start = 0;
  /// In a scene with worlds: the largest fraction of each alone, by the numbers in `answer.worlds`.
  std::vector<double> world_fractions = {};
  Answer answer;  ///< of the trial, with the contacts that come first

  /// Of a trial that reports the earliest contacts.
  static MaxStep of(Answer trial) {
    MaxStep step;
    step.fraction = trial.earliest_toi.value_or(1);
    step.overlaps_at_start =
        trial.overlaps_at_start +
        static_cast<std::uint64_t>(std::ranges::count(trial.contacts.status, ContactStatus::kOverlapAtStart));
    step.world_fractions.reserve(trial.world_tois.size());
    for (const double toi : trial.world_tois) step.world_fractions.push_back(std::min(toi, 1.0));
    step.answer = std::move(trial);
    return step;
  }
};

/// What a daemon allows.
struct ServerLimits {
  std::uint32_t window = 1;  ///< most unanswered frames of a session
  std::uint64_t max_message_bytes = 0;
  std::uint64_t answer_chunk_bytes = 0;
  std::uint32_t max_sessions = 0;
  std::uint64_t max_vertices = 0;   ///< in a session
  std::uint64_t max_triangles = 0;  ///< in a session
  std::uint64_t max_contacts = 0;   ///< in an answer
};

struct ServerInfo {
  std::string version;
  ServerLimits limits;
  std::uint32_t threads = 0;
  std::uint32_t sessions = 0;  ///< open now
  bool draining = false;
  std::chrono::milliseconds uptime{0};
};

/// State of a session in the daemon.
struct SessionInfo {
  /// PairFilters in force, without their arrays; all 0 where none are.
  struct Filters {
    std::uint32_t within_edges = 0;
    double near_at_rest = 0;
    std::uint32_t excluded_vertex_pairs = 0;  ///< how many
    bool patches = false;                     ///< whether there are any
  };

  std::string id;
  std::string principal;  ///< the creator, for callers with the admin role; else empty
  std::uint32_t vertex_count = 0;
  std::uint32_t face_count = 0;
  std::uint32_t edge_count = 0;
  std::uint32_t lone_edge_count = 0;  ///< of these, of no face
  std::uint32_t body_count = 0;
  bool float32 = false;  ///< positions are float32, else float64
  ColliderOptions options;
  Filters filters;
  double most_thickness = 0;      ///< no vertex is thicker; 0 where nothing is
  std::uint32_t world_count = 0;  ///< different worlds that bodies are in, 0 not counted
  std::uint32_t screw_count = 0;  ///< bodies that move along screws
  std::uint64_t last_frame = 0;
  std::uint64_t steps = 0;         ///< since it was created there
  std::uint64_t memory_bytes = 0;  ///< in the daemon
  bool attached = false;           ///< a stream is attached to it
  std::chrono::system_clock::time_point created;
  std::chrono::milliseconds idle{0};  ///< since the last request about it; 0 during a request
};

}  // namespace warmfront::client
