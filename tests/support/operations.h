// SPDX-License-Identifier: Apache-2.0
// What may be done to a collider, or to a session of a daemon, and what came of it, as values that can be
// drawn, carried out again, compared and told of. Plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/collider.h"

namespace warmfront::testing {

/// A frame that owns what it says, and what is asked of it.
struct StepOperation {
  enum class As : std::uint8_t { kStep, kTrial, kMaxStep };
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
/// Several of the two, as one.
struct ChangesOperation {
  std::vector<SceneChange> changes;
};
struct CommitOperation {
  double fraction = 1;
  Rounding rounding = Rounding::kFloat64;
};
struct CheckOperation {};
struct ForgetOperation {};
using Operation = std::variant<StepOperation, PlaceOperation, AddOperation, ChangeOperation, ChangesOperation,
                               CommitOperation, CheckOperation, ForgetOperation>;
std::string to_string(const Operation& operation);

/// What a call came to.
struct Outcome {
  enum class Kind : std::uint8_t { kDone, kRefused, kOutOfMemory };
  Kind kind = Kind::kDone;
  bool met_fault = false;  ///< see Fault: there was an n-th
  Error error{};           ///< of what was refused
  // Of a step.
  std::uint64_t vf = 0;
  std::uint64_t ee = 0;
  std::uint64_t possible = 0;
  std::optional<double> earliest_toi;
  std::vector<Contact> contacts;
  std::vector<ContactGeometry> geometry;

  bool done() const { return kind == Kind::kDone; }
  bool refused(ErrorCode code) const { return kind == Kind::kRefused && error.code == code; }
};
std::string to_string(const Outcome& outcome);

/// What differs, bit for bit, in a few words; empty when nothing does. Of what was refused the codes are
/// compared.
std::string difference(const Outcome& was, const Outcome& expected);

}  // namespace warmfront::testing
