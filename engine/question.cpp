// SPDX-License-Identifier: Apache-2.0
#include "engine/question.h"

namespace warmfront {

ColliderOptions merged(ColliderOptions options, const QuestionOptions& question) {
  options.tier = question.tier.value_or(options.tier);
  options.tolerance = question.tolerance.value_or(options.tolerance);
  options.min_separation = question.min_separation.value_or(options.min_separation);
  options.report = question.report.value_or(options.report);
  options.fields = question.fields.value_or(options.fields);
  options.max_contacts = question.max_contacts.value_or(options.max_contacts);
  options.keep_distance = question.keep_distance;
  return options;
}

ColliderOptions merged(ColliderOptions options, const Question& question) {
  options = merged(options, question.options);
  if (question.kind != QuestionKind::kMaxStep) return options;
  options.report = Report::kEarliest;
  options.fields = {};
  options.leave_out_overlaps = question.leave_out_overlaps;
  return options;
}

Status validate(QuestionKind kind, const QuestionOptions& options) {
  if (options.keep_distance && kind != QuestionKind::kMaxStep)
    return invalid_argument("keep_distance: it is of max_step alone; leave it out");
  return {};
}

}  // namespace warmfront
