// SPDX-License-Identifier: Apache-2.0
#include "engine/question.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>

namespace warmfront {

ColliderOptions merged(ColliderOptions options, const QuestionOptions& question) {
  options.tier = question.tier.value_or(options.tier);
  options.tolerance = question.tolerance.value_or(options.tolerance);
  options.min_separation = question.min_separation.value_or(options.min_separation);
  options.report = question.report.value_or(options.report);
  options.fields = question.fields.value_or(options.fields);
  options.max_contacts = question.max_contacts.value_or(options.max_contacts);
  options.keep_distance = question.keep_distance;
  options.reduced = question.reduced;
  constexpr std::size_t kMostReduced = 0xffffffff;
  if (options.reduced) options.max_contacts = std::min(options.max_contacts, kMostReduced);
  return options;
}

ColliderOptions merged(ColliderOptions options, const Question& question) {
  if (question.of_state()) {
    options.pair_test =
        question.kind == QuestionKind::kProximity ? PairTest::kProximity : PairTest::kIntersection;
    options.instant = question.where == Where::kTrialEnd ? Instant::kEnd : Instant::kStart;
    // The session's report may be one of motions.
    if (options.report != Report::kCount) options.report = Report::kAll;
  }
  options = merged(options, question.options);
  // Which decides touching alone.
  if (question.of_state() && options.tier == Tier::kFast) options.tier = Tier::kCertified;
  if (question.kind == QuestionKind::kIntersections) {
    options.tier = Tier::kExact;
    options.min_separation = 0;
    options.fields = {};
  }
  if (question.kind != QuestionKind::kMaxStep) return options;
  options.report = Report::kEarliest;
  options.fields = {};
  options.leave_out_overlaps = question.leave_out_overlaps;
  if (options.tier != Tier::kFast) options.room_for = question.rounding;
  return options;
}

Status validate(QuestionKind kind, const QuestionOptions& options) {
  if (options.keep_distance && kind != QuestionKind::kMaxStep)
    return invalid_argument("keep_distance: it is of max_step alone; leave it out");
  if (options.reduced && kind != QuestionKind::kProximity)
    return invalid_argument("reduced: it is of proximity alone; leave it out");
  if (kind == QuestionKind::kPlace && options != QuestionOptions())
    return invalid_argument("place: it tests nothing, and has no options; leave them out");
  if (kind == QuestionKind::kMaxStep && options.report)
    return invalid_argument("report: max_step reports the earliest contacts; leave it out");
  if (kind == QuestionKind::kMaxStep && options.fields)
    return invalid_argument("fields: max_step tells of times alone; leave them out");
  if (kind != QuestionKind::kIntersections) return {};
  const std::array<std::pair<bool, const char*>, 4> others{
      {{options.tier.has_value(), "tier"},
       {options.tolerance.has_value(), "tolerance"},
       {options.min_separation.has_value(), "min_separation"},
       {options.fields.has_value(), "fields"}}};
  for (const auto& [given, name] : others) {
    if (given)
      return invalid_argument(std::string(name) +
                              ": intersections are exact, and tell of features alone; leave it out");
  }
  return {};
}

}  // namespace warmfront
