// SPDX-License-Identifier: Apache-2.0
// The questions and commits of a session, and the filling of answers. Thread safety as stated in the
// interface's header.
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "client/c/errors.h"
#include "client/c/reading.h"
#include "client/c/session.h"
#include "client/c/structs.h"

using namespace warmfront;
using namespace warmfront::c;
using warmfront::client::LocalSession;

// Both lists have the same numbers.
static_assert(WF_VERTEX_HALF_SPACE == static_cast<int>(ContactKind::kVertexHalfSpace));
static_assert(WF_BUDGET == static_cast<int>(ContactStatus::kBudget));

namespace {

void fill(const wf_session& session, wf_answer* answer, std::size_t size) {
  if (answer == nullptr) return;
  const client::Answer& from = session.answer;
  const client::ContactTable& table = from.contacts;
  wf_answer to{};
  to.frame = from.frame;
  to.vf = from.vf;
  to.ee = from.ee;
  to.ve = from.ve;
  to.vv = from.vv;
  to.ef = from.ef;
  to.vh = from.vh;
  to.possible = from.possible;
  to.overlaps_at_start = from.overlaps_at_start;
  to.earliest_toi = from.earliest_toi.value_or(std::numeric_limits<double>::infinity());
  to.rows = table.size();
  to.kind = column<std::uint8_t>(table.kind);
  to.status = column<std::uint8_t>(table.status);
  to.vertices = table.edge_faces.empty() ? column<std::uint32_t>(table.vertices)
                                         : column<std::uint32_t>(table.edge_faces);
  to.features = column<std::uint32_t>(session.features);
  to.toi = column<double>(table.toi);
  to.weights = column<double>(table.weights);
  to.normal = column<double>(table.normal);
  to.points = column<double>(table.points);
  to.direction = column<double>(table.direction);
  to.squared_distance = column<double>(table.squared_distance);
  to.closest = column<std::uint8_t>(table.closest);
  to.multiplicity = column<std::uint32_t>(table.multiplicity);
  to.stencil = column<std::uint8_t>(table.stencil);
  to.distances = from.vertex_distances.size();
  to.vertex_distances = column<double>(from.vertex_distances);
  to.world_count = from.worlds.size();
  to.worlds = column<std::uint32_t>(from.worlds);
  to.world_tois = column<double>(from.world_tois);
  to.ms = from.statistics.ms.total;
  write(answer, size, to);
}

wf_code ask(wf_session* session, QuestionKind kind, const wf_frame* frame, const wf_question* given,
            std::optional<double> distance, bool by_vertex, wf_answer* answer, std::size_t size) noexcept {
  return guarded([&]() -> wf_code {
    if (session == nullptr) return fail(WF_INVALID_ARGUMENT, "session: is null");
    const Result<wf_question> read_question = read(given, initial_question(), "question");
    if (!read_question) return fail(read_question.error());
    Result<Question> question = question_of(kind, read_question.value());
    if (!question) return fail(question.error());
    if (distance) question.value().options.min_separation = *distance;
    if (by_vertex) question.value().options.report = Report::kVertexDistances;
    GivenFrame where;
    if (Status taken = take_frame(*session, frame, where); !taken) return fail(taken.error());
    std::vector<std::array<std::uint32_t, 2>> features;
    const auto keep = [&](const StepResult& step) -> Status {
      features.reserve(step.contacts.size());
      for (const Contact& contact : step.contacts) features.push_back({contact.a, contact.b});
      return {};
    };
    const wf_flag* flag = read_question.value().cancelled;
    const LocalSession::Request request{.frame = where.frame, .question = question.value(), .accept = keep};
    Result<client::Answer> told =
        session->local->ask(request, {.cancelled = flag == nullptr ? nullptr : &flag->value}, false)->take();
    if (!told) return fail(told.error());
    session->answer = std::move(told).value();
    session->features = std::move(features);
    fill(*session, answer, size);
    return WF_OK;
  });
}

}  // namespace

wf_code wf_step(wf_session* session, const wf_frame* frame, const wf_question* question, wf_answer* answer,
                size_t answer_size) {
  return ask(session, QuestionKind::kStep, frame, question, std::nullopt, false, answer, answer_size);
}
wf_code wf_trial(wf_session* session, const wf_frame* frame, const wf_question* question, wf_answer* answer,
                 size_t answer_size) {
  return ask(session, QuestionKind::kTrial, frame, question, std::nullopt, false, answer, answer_size);
}
wf_code wf_max_step(wf_session* session, const wf_frame* frame, const wf_question* question, double* fraction,
                    wf_answer* answer, size_t answer_size) {
  const wf_code code =
      ask(session, QuestionKind::kMaxStep, frame, question, std::nullopt, false, answer, answer_size);
  if (code == WF_OK && fraction != nullptr) *fraction = session->answer.earliest_toi.value_or(1);
  return code;
}
wf_code wf_commit(wf_session* session, double fraction) {
  return guarded([&]() -> wf_code {
    if (session == nullptr) return fail(WF_INVALID_ARGUMENT, "session: is null");
    const Result<client::Answer> taken = session->local->ask({.commit = fraction}, {}, false)->take();
    return taken ? wf_code{WF_OK} : fail(taken.error());
  });
}
wf_code wf_place(wf_session* session, const wf_frame* frame) {
  return ask(session, QuestionKind::kPlace, frame, nullptr, std::nullopt, false, nullptr, 0);
}
wf_code wf_proximity(wf_session* session, double distance, const wf_question* question, wf_answer* answer,
                     size_t answer_size) {
  return ask(session, QuestionKind::kProximity, nullptr, question, distance, false, answer, answer_size);
}
wf_code wf_vertex_distances(wf_session* session, double distance, const wf_question* question,
                            wf_answer* answer, size_t answer_size) {
  return ask(session, QuestionKind::kProximity, nullptr, question, distance, true, answer, answer_size);
}
wf_code wf_intersections(wf_session* session, const wf_question* question, wf_answer* answer,
                         size_t answer_size) {
  return ask(session, QuestionKind::kIntersections, nullptr, question, std::nullopt, false, answer,
             answer_size);
}
