// SPDX-License-Identifier: Apache-2.0
// What is asked of a warm scene beside a step. Plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/contact.h"
#include "engine/options.h"
#include "engine/result.h"
#include "engine/statistics.h"

namespace warmfront {

/// Options of one question; what is absent is as the collider was created with. Ranges as ColliderOptions
/// says. An answer never depends on what was asked before. A question whose options differ from those of the
/// one before tests again what is stationary.
struct QuestionOptions {
  std::optional<Tier> tier = std::nullopt;
  std::optional<double> tolerance = std::nullopt;
  std::optional<double> min_separation = std::nullopt;
  std::optional<Report> report = std::nullopt;
  std::optional<ContactFields> fields = std::nullopt;
  std::optional<std::size_t> max_contacts = std::nullopt;
  /// Of max_step alone, in (0, 1), not in the fast tier: no pair may come nearer than this share of its own
  /// distance at the start. With a min_separation m, a pair that starts d apart is in contact when it comes
  /// within m + keep_distance (d - m), and one that starts within m as without, or where
  /// overlaps are left out when it comes within keep_distance d. Decided as the certified tier
  /// does (the exact tier: with a tolerance of 2^-32), to within 2^-8 of what each pair may approach. Costs
  /// what a min_separation of m + 2 L keep_distance / (1 - keep_distance) does, L being the longest way of a
  /// vertex.
  std::optional<double> keep_distance = std::nullopt;
  /// Of proximity alone: each closest pair once, with its multiplicity. See ColliderOptions::reduced.
  bool reduced = false;

  friend bool operator==(const QuestionOptions&, const QuestionOptions&) = default;
};

/// The collider's options with those of a question in their places.
ColliderOptions merged(ColliderOptions options, const QuestionOptions& question);

/// By the names of Collider's functions.
enum class QuestionKind : std::uint8_t { kStep, kTrial, kMaxStep, kProximity, kIntersections, kPlace };

/// The state that a question without a motion of its own is asked of.
enum class Where : std::uint8_t {
  kBase,      ///< where everything is, and trials begin
  kTrialEnd,  ///< where the last trial would take it
};

/// Which of Collider's questions is asked of a frame, as a value, for those who pass questions on.
struct Question {
  QuestionKind kind = QuestionKind::kStep;
  QuestionOptions options = {};
  bool leave_out_overlaps = false;  ///< of kMaxStep alone
  /// Of kProximity, whose distance is options.min_separation, and kIntersections.
  Where where = Where::kBase;
  Rounding rounding = Rounding::kFloat64;  ///< of kMaxStep alone: of the commit that follows

  /// Which pairs are within `distance` of each other?
  static Question proximity(double distance, Where where, const QuestionOptions& options) {
    Question question{.kind = QuestionKind::kProximity, .options = options, .where = where};
    question.options.min_separation = distance;
    return question;
  }

  /// How far is each vertex from anything, at most `distance`? A proximity question.
  static Question vertex_distances(double distance, Where where, const QuestionOptions& options) {
    Question question = proximity(distance, where, options);
    question.options.report = Report::kVertexDistances;
    return question;
  }

  /// Which edges meet which faces?
  static Question intersections(Where where, const QuestionOptions& options) {
    return {.kind = QuestionKind::kIntersections, .options = options, .where = where};
  }
  /// Is everything at the frame's end from then on?
  bool counts() const { return kind == QuestionKind::kStep || kind == QuestionKind::kPlace; }
  /// Is it about a state, and no motion?
  bool of_state() const { return kind == QuestionKind::kProximity || kind == QuestionKind::kIntersections; }

  friend bool operator==(const Question&, const Question&) = default;
};

/// The same of a question with its kind: kMaxStep reports the earliest contacts, without fields, and leaves
/// room for roundings (except in tier fast); kProximity tests distances, in tier certified where the
/// session's is fast, which knows no separation; kIntersections is exact, without a separation and fields.
ColliderOptions merged(ColliderOptions options, const Question& question);

/// kInvalidArgument, naming the field, for options that a question of its kind does not have: of
/// kIntersections, which is exact and tells of features alone, all but report and max_contacts; of kPlace,
/// which tests nothing, all; of kMaxStep, which reports the earliest contacts, report and fields.
Status validate(QuestionKind kind, const QuestionOptions& options);

/// What a commit did.
struct CommitResult {
  double fraction = 1;
  /// Of the contacts that the trial listed (Report::kAll, kEarliest), those with toi <= fraction. Of
  /// Report::kCount the trial's own counts for fraction 1; none where only some of them lie within it.
  std::optional<std::uint64_t> vf;
  std::optional<std::uint64_t> ee;
  std::optional<std::uint64_t> vh = std::nullopt;
  std::optional<double> earliest_toi;  ///< none where no contact is known within the fraction
  /// Of these, those neither proved nor excluded; none where these are.
  std::optional<std::uint64_t> possible = std::nullopt;
};

/// How far a motion may go.
struct MaxStep {
  /// In [0, 1]: nothing touches, or comes within the separation (with keep_distance its own), or nearer than
  /// a commit rounds, before it. Tiers certified and exact: a lower bound. 1 where nothing does in the whole
  /// motion; then, and only then, `first` is empty.
  double fraction = 1;
  /// Of what comes first, the first in the order of contacts.
  std::optional<Contact> first;
  /// Pairs that are within the separation, or nearer than a commit rounds, or not provably apart, at the
  /// start: counted whether they are left out or not. Where they are not, any that comes nearer makes
  /// `fraction` 0.
  std::uint64_t overlaps_at_start = 0;
  /// In a scene with worlds: their numbers, as StepResult has them, and the largest fraction of each alone.
  std::vector<std::uint32_t> worlds;
  std::vector<double> world_fractions;
  StepStatistics statistics;
};

}  // namespace warmfront
