// SPDX-License-Identifier: Apache-2.0
#include "client/lib/any_session.h"

#include <utility>

namespace warmfront::client {
namespace {

ContactTable columns_of(const StepResult& step, const Scene& scene, const ContactFields& fields) {
  ContactTable table;
  table.kind.reserve(step.contacts.size());
  table.status.reserve(step.contacts.size());
  table.vertices.reserve(step.contacts.size());
  table.toi.reserve(step.contacts.size());
  for (const Contact& contact : step.contacts) {
    table.kind.push_back(contact.kind);
    table.status.push_back(contact.status);
    if (contact.kind == ContactKind::kEdgeFace)
      table.edge_faces.push_back(scene.edge_face_vertices_of(contact));
    else
      table.vertices.push_back(scene.vertices_of(contact));
    table.toi.push_back(contact.toi);
  }
  for (const ContactGeometry& geometry : step.geometry) {
    if (fields.weights) table.weights.push_back(geometry.weights);
    if (fields.normal) table.normal.push_back(geometry.normal);
    if (fields.points) table.points.push_back(geometry.points);
    if (fields.direction) table.direction.push_back(geometry.direction);
    if (fields.squared_distance) table.squared_distance.push_back(geometry.squared_distance);
    if (fields.closest) table.closest.push_back(geometry.closest);
  }
  for (const ClosestPair& pair : step.closest_pairs) {
    table.multiplicity.push_back(pair.multiplicity);
    table.stencil.push_back(pair.stencil);
  }
  return table;
}

}  // namespace

Result<AnySession> AnySession::create(SceneDescription description, const Positions& positions,
                                      const ColliderOptions& options, std::shared_ptr<Workers> workers) {
  if (workers == nullptr) workers = std::make_shared<Workers>(0);
  description.filters.rest_at(positions);
  Result<Scene> scene = Scene::create(std::move(description));
  if (!scene) return scene.error();
  Result<Collider> collider = Collider::create(std::make_shared<const Scene>(std::move(scene).value()),
                                               positions, options, std::move(workers));
  if (!collider) return collider.error();
  const bool single = std::holds_alternative<std::span<const float>>(positions);
  return AnySession(Local{std::move(collider).value(), single ? Rounding::kFloat32 : Rounding::kFloat64});
}

Result<Answer> AnySession::Local::ask(const Frame& moved, const Question& question) {
  const Result<StepResult> result = collider.ask(moved, question);
  if (!result) return result.error();
  const StepResult& step = result.value();
  Answer answer;
  answer.frame = frame + 1;
  static_cast<KindCounts&>(answer) = step;
  answer.possible = step.possible;
  answer.earliest_toi = step.earliest_toi;
  answer.overlaps_at_start = step.overlaps_at_start;
  answer.contacts = columns_of(step, collider.scene(), merged(collider.options(), question).fields);
  answer.vertex_distances.assign(step.vertex_distances.begin(), step.vertex_distances.end());
  answer.statistics = step.statistics;
  if (step.all_deformable) answer.all_deformable.emplace(AllDeformable{*step.all_deformable});
  if (question.counts()) ++frame;
  return answer;
}

Result<Answer> AnySession::step(const Frame& frame, const QuestionOptions& options) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->step(frame, options);
  return std::get<Local>(held_).ask(frame, {.options = options});
}

Result<Answer> AnySession::place(const Frame& frame) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->place(frame);
  return std::get<Local>(held_).ask(frame, {QuestionKind::kPlace});
}

Result<Answer> AnySession::trial(const Frame& frame, const QuestionOptions& options) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->trial(frame, options);
  return std::get<Local>(held_).ask(frame, {QuestionKind::kTrial, options});
}

Result<MaxStep> AnySession::max_step(const Frame& frame, bool leave_out_overlaps,
                                     const QuestionOptions& options) {
  if (auto* remote = std::get_if<Session>(&held_))
    return remote->max_step(frame, leave_out_overlaps, options);
  Result<Answer> answer =
      std::get<Local>(held_).ask(frame, {QuestionKind::kMaxStep, options, leave_out_overlaps});
  if (!answer) return answer.error();
  return MaxStep::of(std::move(answer).value(), leave_out_overlaps);
}

Result<Answer> AnySession::proximity(double distance, Where where, const QuestionOptions& options) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->proximity(distance, where, options);
  return std::get<Local>(held_).ask(Frame(), Question::proximity(distance, where, options));
}

Result<Answer> AnySession::vertex_distances(double distance, Where where, const QuestionOptions& options) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->vertex_distances(distance, where, options);
  return std::get<Local>(held_).ask(Frame(), Question::vertex_distances(distance, where, options));
}

Result<Answer> AnySession::intersections(Where where, const QuestionOptions& options) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->intersections(where, options);
  return std::get<Local>(held_).ask(Frame(), Question::intersections(where, options));
}

Result<CommitResult> AnySession::commit(double fraction) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->commit(fraction);
  Local& local = std::get<Local>(held_);
  Result<CommitResult> result = local.collider.commit(fraction, local.rounding);
  if (result) ++local.frame;
  return result;
}

Result<std::uint32_t> AnySession::add_body(BodyAddition addition, const Positions& positions) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->add_body(std::move(addition), positions);
  return std::get<Local>(held_).collider.add_body(std::move(addition), positions);
}

Status AnySession::change_body(std::uint32_t index, Body body) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->change_body(index, std::move(body));
  return std::get<Local>(held_).collider.change_body(index, std::move(body));
}

Status AnySession::change_filters(PairFilters filters) {
  if (auto* remote = std::get_if<Session>(&held_)) return remote->change_filters(std::move(filters));
  return std::get<Local>(held_).collider.change_filters(std::move(filters));
}

}  // namespace warmfront::client
