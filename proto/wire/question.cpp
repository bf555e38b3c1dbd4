// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/question.h"

#include <string>

#include "proto/wire/enums.h"
#include "proto/wire/options.h"

namespace warmfront::wire {

v1::Question to_proto(const Question& question) {
  v1::Question message;
  message.set_kind(to_proto(question.kind));
  const QuestionOptions& options = question.options;
  if (options.tier) message.set_tier(to_proto(*options.tier));
  if (options.tolerance) message.set_tolerance(*options.tolerance);
  if (options.min_separation) message.set_min_separation(*options.min_separation);
  if (options.report) message.set_report(to_proto(*options.report));
  if (options.fields) *message.mutable_fields() = to_proto(*options.fields);
  if (options.max_contacts) message.set_max_contacts(*options.max_contacts);
  message.set_leave_out_overlaps(question.leave_out_overlaps);
  if (question.of_state()) message.set_where(to_proto(question.where));
  if (options.keep_distance) message.set_keep_distance(*options.keep_distance);
  if (options.reduced) message.set_reduced(true);
  return message;
}

Result<Question> question_from(const v1::Question& message) {
  Question question;
  QuestionOptions& options = question.options;
  if (Status known = read(message.kind(), "question.kind", question.kind); !known) return known.error();
  if (Status known = read(message.tier(), "question.tier", options.tier.emplace()); !known)
    return known.error();
  if (message.tier() == v1::TIER_UNSPECIFIED) options.tier.reset();
  if (Status known = read(message.report(), "question.report", options.report.emplace()); !known)
    return known.error();
  if (message.report() == v1::REPORT_UNSPECIFIED) options.report.reset();
  if (message.has_tolerance()) options.tolerance = message.tolerance();
  if (message.has_min_separation()) options.min_separation = message.min_separation();
  if (message.has_fields()) options.fields = fields_from(message.fields());
  if (message.has_max_contacts()) options.max_contacts = message.max_contacts();
  question.leave_out_overlaps = message.leave_out_overlaps();
  if (message.has_keep_distance()) options.keep_distance = message.keep_distance();
  options.reduced = message.reduced();
  if (Status known = read(message.where(), "question.where", question.where); !known) return known.error();
  if (message.where() != v1::Question::WHERE_UNSPECIFIED && !question.of_state())
    return invalid_argument("question.where: it is of KIND_PROXIMITY and KIND_INTERSECTIONS only");
  if (question.kind != QuestionKind::kMaxStep) {
    if (question.leave_out_overlaps)
      return invalid_argument("question.leave_out_overlaps: it is of KIND_MAX_STEP only");
    if (options.keep_distance) return invalid_argument("question.keep_distance: it is of KIND_MAX_STEP only");
  }
  if (Status valid = validate(question.kind, options); !valid)
    return Error{valid.error().code, "question." + valid.error().message};
  return question;
}

}  // namespace warmfront::wire
