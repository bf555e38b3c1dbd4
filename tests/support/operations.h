// SPDX-License-Identifier: Apache-2.0
// Operations on a collider, or on a session of a daemon, and their outcomes, as values that can be generated,
// repeated, compared and printed. Plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/collider.h"

namespace warmfront::testing {

/// A frame that owns its data, and the question about it.
struct StepOperation {
  enum class As : std::uint8_t { kStep, kTrial, kMaxStep, kPlace };
  As as = As::kStep;
  QuestionOptions options;
  bool leave_out_overlaps = false;  // of kMaxStep
  struct Rows {
    std::uint32_t body;
    std::vector<double> positions;
  };
  std::optional<std::vector<double>> all;
  std::vector<Rows> bodies;
  std::vector<BodyPose> poses;
  std::vector<std::uint32_t> vertices;
  std::vector<double> vertex_positions;
};
struct PlaceOperation {
  std::vector<BodyPose> poses;
};
struct AddOperation {
  BodyAddition addition;
  std::vector<double> positions;
};
struct ChangeOperation {
  std::uint32_t body;
  Body as;
};
/// Several additions and changes as one operation, perhaps with other options.
struct ChangesOperation {
  std::vector<SceneChange> changes;
  std::optional<ColliderOptions> options = std::nullopt;
};
struct CommitOperation {
  double fraction = 1;
  Rounding rounding = Rounding::kFloat64;
};
/// Which pairs are near? A question without a motion.
/// Of a state: what is near, by pairs or (Report::kVertexDistances) by vertex, or what is tangled.
struct NearOperation {
  double distance = 0;
  Where where = Where::kBase;
  QuestionOptions options;
  bool tangled = false;  ///< intersections(), without a distance

  Question question() const {
    return tangled ? Question::intersections(where, options) : Question::proximity(distance, where, options);
  }
};
struct CheckOperation {};
struct ForgetOperation {};
using Operation = std::variant<StepOperation, PlaceOperation, AddOperation, ChangeOperation, ChangesOperation,
                               CommitOperation, NearOperation, CheckOperation, ForgetOperation>;
std::string to_string(const Operation& operation);

/// The outcome of a call.
struct Outcome {
  enum class Kind : std::uint8_t { kDone, kRefused, kOutOfMemory };
  Kind kind = Kind::kDone;
  bool met_fault = false;  ///< see Fault: the n-th event occurred
  Error error{};           ///< of a refused call
  // Of a step or a question.
  std::uint64_t vf = 0;
  std::uint64_t ee = 0;
  std::uint64_t ef = 0;
  std::uint64_t vh = 0;
  std::uint64_t possible = 0;
  std::optional<double> earliest_toi;
  std::vector<Contact> contacts;
  std::vector<ContactGeometry> geometry;
  std::vector<ClosestPair> closest_pairs;
  std::vector<double> vertex_distances;
  std::vector<std::uint32_t> worlds;
  std::vector<double> world_tois;  // of a max_step, at most 1

  bool done() const { return kind == Kind::kDone; }
  bool refused(ErrorCode code) const { return kind == Kind::kRefused && error.code == code; }
};
std::string to_string(const Outcome& outcome);

/// The difference, bit for bit, in a few words; empty if there is none. For refused calls the codes are
/// compared.
std::string difference(const Outcome& was, const Outcome& expected);

}  // namespace warmfront::testing
