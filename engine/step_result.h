// SPDX-License-Identifier: Apache-2.0
// What a step answers. Plain views: as valid as each says.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "engine/contact.h"
#include "engine/result.h"
#include "engine/statistics.h"

namespace warmfront {

/// One step's answer. `contacts` stays valid until the next step of the same collider.
struct StepResult : KindCounts {
  std::uint64_t possible = 0;  ///< of vf, ee and vh, those neither proved nor excluded (kPossible, kBudget)
  /// Of max_step(): what starts within the separation, or nearer than a commit rounds, and is no contact at
  /// the start. With options.leave_out_overlaps alone what that leaves out, of what was looked at: of
  /// features at rest since the question before only with Report::kEarliest.
  std::uint64_t overlaps_at_start = 0;
  std::optional<double> earliest_toi;  ///< least toi of the step; none without contacts
  /// Sorted by (kind, a, b) as Contact has them. Empty for Report::kCount.
  std::span<const Contact> contacts;
  /// Of each contact, when any of options.fields is asked for; as valid as `contacts`.
  std::span<const ContactGeometry> geometry = {};
  /// Of each contact of a reduced answer, what it stands for; as valid as `contacts`. vf, ee and possible
  /// count the rows that were reduced.
  std::span<const ClosestPair> closest_pairs = {};
  /// Of Report::kVertexDistances, by vertex: a lower bound of the least distance of any pair
  /// that the vertex is in, less the thickness of both (0 where that is more), in the scene's
  /// unit; at most the distance that was asked about, and that much where there is no pair within it. As
  /// valid as `contacts`.
  std::span<const double> vertex_distances = {};
  /// Of Report::kEarliest in a scene with worlds: their numbers, ascending, with 0 where a body is in none
  /// (and so in all), and the least toi in each, infinity without a contact. A contact is in the world that
  /// either body has. As valid as `contacts`.
  std::span<const std::uint32_t> worlds = {};
  std::span<const double> world_tois = {};
  StepStatistics statistics;
  /// With options.explain: of the same step with everything deformable; what the scene's model saves is the
  /// difference.
  std::optional<StepStatistics> all_deformable = std::nullopt;
};

/// Called with a step's answer before the step is taken, on the thread that steps. An error that it returns,
/// or an exception, refuses the step, which then did not happen. The statistics' times and front state may
/// still change. Empty: every answer is accepted.
using AcceptStep = std::function<Status(const StepResult&)>;

}  // namespace warmfront
