// SPDX-License-Identifier: Apache-2.0
// Conversion between the engine's enums and the contract's. Both list the same names in the same order; the
// contract's begin with UNSPECIFIED. Pure functions.
#pragma once

#include <optional>
#include <string>

#include "engine/options.h"
#include "engine/question.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "engine/statistics.h"
#include "warmfront/v1/options.pb.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::wire {

template <class Enum>
struct Counterpart;
template <>
struct Counterpart<Tier> {
  using Type = v1::Tier;
  static constexpr int kLast = v1::TIER_EXACT;
};
template <>
struct Counterpart<Report> {
  using Type = v1::Report;
  static constexpr int kLast = v1::REPORT_VERTEX_DISTANCES;
};
template <>
struct Counterpart<FrontMode> {
  using Type = v1::FrontMode;
  static constexpr int kLast = v1::FRONT_MODE_WARM;
};
template <>
struct Counterpart<BoundsKind> {
  using Type = v1::BoundsKind;
  static constexpr int kLast = v1::BOUNDS_KIND_AUTO;
};
template <>
struct Counterpart<BodyKind> {
  using Type = v1::BodyKind;
  static constexpr int kLast = v1::BODY_KIND_REMOVED;
};
template <>
struct Counterpart<QuestionKind> {
  using Type = v1::Question::Kind;
  static constexpr int kLast = v1::Question::KIND_PLACE;
};
template <>
struct Counterpart<Where> {
  using Type = v1::Question::Where;
  static constexpr int kLast = v1::Question::WHERE_TRIAL_END;
};
template <>
struct Counterpart<FrontState> {
  using Type = v1::FrontState;
  static constexpr int kLast = v1::FRONT_STATE_CAPPED;
};

template <class Enum>
constexpr typename Counterpart<Enum>::Type to_proto(Enum value) {
  return static_cast<typename Counterpart<Enum>::Type>(static_cast<int>(value) + 1);
}

/// None for UNSPECIFIED and for values of a contract newer than this build.
template <class Enum>
constexpr std::optional<Enum> known(typename Counterpart<Enum>::Type value) {
  if (value < 1 || value > Counterpart<Enum>::kLast) return std::nullopt;
  return static_cast<Enum>(static_cast<int>(value) - 1);
}

/// kInvalidArgument, naming the field, for a value that this build does not know.
template <class Enum>
Status read(typename Counterpart<Enum>::Type value, const std::string& field, Enum& into) {
  if (value == 0) return {};
  const std::optional<Enum> one = known<Enum>(value);
  if (!one)
    return invalid_argument(field + ": value " + std::to_string(value) +
                            " is unknown to this daemon; see its enum in warmfront.v1");
  into = *one;
  return {};
}

static_assert(to_proto(Tier::kFast) == v1::TIER_FAST && to_proto(Tier::kCertified) == v1::TIER_CERTIFIED &&
              to_proto(Tier::kExact) == v1::TIER_EXACT);
static_assert(to_proto(Report::kAll) == v1::REPORT_ALL &&
              to_proto(Report::kEarliest) == v1::REPORT_EARLIEST &&
              to_proto(Report::kCount) == v1::REPORT_COUNT &&
              to_proto(Report::kCandidates) == v1::REPORT_CANDIDATES &&
              to_proto(Report::kAny) == v1::REPORT_ANY &&
              to_proto(Report::kVertexDistances) == v1::REPORT_VERTEX_DISTANCES);
static_assert(to_proto(FrontMode::kNone) == v1::FRONT_MODE_NONE &&
              to_proto(FrontMode::kPaper) == v1::FRONT_MODE_PAPER &&
              to_proto(FrontMode::kWarm) == v1::FRONT_MODE_WARM);
static_assert(to_proto(BoundsKind::kAabb) == v1::BOUNDS_KIND_AABB &&
              to_proto(BoundsKind::kKDop18) == v1::BOUNDS_KIND_KDOP18 &&
              to_proto(BoundsKind::kAuto) == v1::BOUNDS_KIND_AUTO);
static_assert(to_proto(BodyKind::kDeformable) == v1::BODY_KIND_DEFORMABLE &&
              to_proto(BodyKind::kRigid) == v1::BODY_KIND_RIGID &&
              to_proto(BodyKind::kStatic) == v1::BODY_KIND_STATIC &&
              to_proto(BodyKind::kRemoved) == v1::BODY_KIND_REMOVED);
static_assert(to_proto(QuestionKind::kStep) == v1::Question::KIND_STEP &&
              to_proto(QuestionKind::kTrial) == v1::Question::KIND_TRIAL &&
              to_proto(QuestionKind::kMaxStep) == v1::Question::KIND_MAX_STEP &&
              to_proto(QuestionKind::kProximity) == v1::Question::KIND_PROXIMITY &&
              to_proto(QuestionKind::kIntersections) == v1::Question::KIND_INTERSECTIONS &&
              to_proto(QuestionKind::kPlace) == v1::Question::KIND_PLACE);
static_assert(to_proto(Where::kBase) == v1::Question::WHERE_BASE &&
              to_proto(Where::kTrialEnd) == v1::Question::WHERE_TRIAL_END);
static_assert(to_proto(FrontState::kNone) == v1::FRONT_STATE_NONE &&
              to_proto(FrontState::kBuilt) == v1::FRONT_STATE_BUILT &&
              to_proto(FrontState::kUpdated) == v1::FRONT_STATE_UPDATED &&
              to_proto(FrontState::kRebuilt) == v1::FRONT_STATE_REBUILT &&
              to_proto(FrontState::kCapped) == v1::FRONT_STATE_CAPPED);

}  // namespace warmfront::wire
