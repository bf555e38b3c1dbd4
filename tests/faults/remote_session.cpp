// SPDX-License-Identifier: Apache-2.0
#include "tests/faults/remote_session.h"

#include <cstring>
#include <optional>
#include <utility>

namespace warmfront::test {
namespace {

using testing::AcceptedState;
using testing::AddOperation;
using testing::ChangeOperation;
using testing::Operation;
using testing::Outcome;
using testing::StepOperation;

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

std::string difference(const client::Answer& answer, const Outcome& expected, const Scene& scene,
                       const ContactFields& fields) {
  if (answer.vf != expected.vf || answer.ee != expected.ee || answer.ef != expected.ef ||
      answer.vh != expected.vh || answer.possible != expected.possible)
    return "vf " + std::to_string(answer.vf) + ", ee " + std::to_string(answer.ee) + ", vh " +
           std::to_string(answer.vh) + ", possible " +
           std::to_string(answer.possible) + " where " + to_string(expected) + " is expected";
  if (answer.earliest_toi != expected.earliest_toi) return "another earliest_toi";
  client::ContactTable table;
  for (std::size_t i = 0; i < expected.contacts.size(); ++i) {
    const Contact& contact = expected.contacts[i];
    table.kind.push_back(contact.kind);
    table.status.push_back(contact.status);
    if (contact.kind == ContactKind::kEdgeFace)
      table.edge_faces.push_back(scene.edge_face_vertices_of(contact));
    else
      table.vertices.push_back(scene.vertices_of(contact));
    table.toi.push_back(contact.toi);
    if (fields.weights) table.weights.push_back(expected.geometry[i].weights);
    if (fields.normal) table.normal.push_back(expected.geometry[i].normal);
    if (fields.points) table.points.push_back(expected.geometry[i].points);
    if (fields.direction) table.direction.push_back(expected.geometry[i].direction);
    if (fields.squared_distance) table.squared_distance.push_back(expected.geometry[i].squared_distance);
    if (fields.closest) table.closest.push_back(expected.geometry[i].closest);
  }
  for (const ClosestPair& pair : expected.closest_pairs) {
    table.multiplicity.push_back(pair.multiplicity);
    table.stencil.push_back(pair.stencil);
  }
  const client::ContactTable& given = answer.contacts;
  if (given.kind != table.kind || given.status != table.status || given.vertices != table.vertices ||
      given.edge_faces != table.edge_faces)
    return "other contacts";
  if (!same_bits(answer.vertex_distances, expected.vertex_distances)) return "other distances";
  if (!same_bits(given.toi, table.toi)) return "other times";
  if (given.multiplicity != table.multiplicity || given.stencil != table.stencil)
    return "other closest pairs";
  const bool same_fields =
      same_bits(given.weights, table.weights) && same_bits(given.normal, table.normal) &&
      same_bits(given.points, table.points) && same_bits(given.direction, table.direction) &&
      same_bits(given.squared_distance, table.squared_distance) && given.closest == table.closest;
  return same_fields ? "" : "other fields";
}

}  // namespace

RemoteSession::RemoteSession(SessionDriver& driver, AcceptedState state, const ColliderOptions& options,
                             std::size_t few)
    : driver_(driver), state_(std::move(state)), options_(options), few_(few) {
  state_.rounding = rounding();
}

std::string RemoteSession::create() {
  const Status made = driver_.create(state_, options_);
  return made.ok() ? "" : "create: " + made.error().message;
}

std::string RemoteSession::step(const StepOperation& operation, const Around& around) {
  std::optional<Result<client::Answer>> answer;
  around([&] { answer.emplace(driver_.step(operation)); });
  bool accepted = false;
  return check(operation, *answer, accepted);
}

std::string RemoteSession::two_steps(const StepOperation& first, const StepOperation& second,
                                     const std::function<void()>& between) {
  for (const StepOperation* step : {&first, &second}) {
    const Status submitted = driver_.submit(*step);
    if (!submitted.ok()) return "submit: " + submitted.error().message;
  }
  between();
  bool accepted = false;
  if (std::string wrong = check(first, driver_.next_answer(), accepted); !wrong.empty()) return wrong;
  const auto answer = driver_.next_answer();
  if (accepted) return check(second, answer, accepted);
  if (answer.ok() || answer.error().code != ErrorCode::kFailedPrecondition)
    return "a frame after one that was refused must be refused as out of order";
  return "";
}

std::string RemoteSession::check(const StepOperation& operation, const Result<client::Answer>& answer,
                                 bool& accepted) {
  const Outcome expected = state_.brute_force(operation, options_);
  accepted = answer.ok();
  if (!answer.ok()) {
    state_.trial.reset();  // no commit follows a question that failed
    if (answer.error().code == ErrorCode::kResourceExhausted && expected.contacts.size() > few_) return "";
    // What a max_step lists besides its first contact is not told here.
    if (answer.error().code == ErrorCode::kResourceExhausted && operation.as == StepOperation::As::kMaxStep)
      return "";
    if (answer.error().code == ErrorCode::kInvalidArgument && expected.refused(ErrorCode::kInvalidArgument))
      return "";
    return to_string(Operation(operation)) + ": " + answer.error().message;
  }
  if (!expected.done()) return to_string(Operation(operation)) + ": answered, and it is wrong";
  if (operation.as == StepOperation::As::kMaxStep) {
    const bool same = answer.value().earliest_toi == expected.earliest_toi &&
                      (answer.value().contacts.size() == 0) == expected.contacts.empty();
    state_.accept(operation);
    return same ? "" : to_string(Operation(operation)) + ": another fraction";
  }
  const Scene scene = Scene::create(state_.scene).value();
  const std::string differs =
      difference(answer.value(), expected, scene, merged(options_, operation.options).fields);
  state_.accept(operation);
  return differs.empty() ? "" : to_string(Operation(operation)) + ": " + differs;
}

std::string RemoteSession::commit(double fraction, const Around& around) {
  std::optional<Result<CommitResult>> commit;
  around([&] { commit.emplace(driver_.commit(fraction)); });
  return check_commit(fraction, *commit);
}

std::string RemoteSession::check_commit(double fraction, const Result<CommitResult>& commit) {
  if (!state_.trial) {
    if (!commit.ok() && commit.error().code == ErrorCode::kFailedPrecondition) return "";
    return "a commit of no trial: " + (commit.ok() ? "carried out" : commit.error().message);
  }
  if (!commit.ok()) return "commit " + std::to_string(fraction) + ": " + commit.error().message;
  const Outcome trial = state_.brute_force(*state_.trial, options_);
  const bool within = trial.earliest_toi && *trial.earliest_toi <= fraction;
  std::string wrong;
  if (commit.value().earliest_toi != (within ? trial.earliest_toi : std::nullopt))
    wrong = "another earliest_toi";
  const bool listed = trial.contacts.size() == trial.vf + trial.ee + trial.vh;
  if (state_.trial->as == StepOperation::As::kTrial && (listed || fraction == 1)) {
    KindCounts within;
    for (const Contact& contact : trial.contacts)
      if (contact.toi <= fraction) within.count(contact.kind);
    if (!listed) within = {.vf = trial.vf, .ee = trial.ee, .vh = trial.vh};
    if (commit.value().vf != within.vf || commit.value().ee != within.ee || commit.value().vh != within.vh)
      wrong = "other counts";
  }
  state_.accept(testing::CommitOperation{fraction, rounding()});
  return wrong.empty() ? "" : "commit " + std::to_string(fraction) + ": " + wrong;
}

std::string RemoteSession::trial_commit_step(const StepOperation& trial, double fraction,
                                             const StepOperation& step,
                                             const std::function<void()>& between) {
  if (const Status sent = driver_.submit(trial); !sent.ok()) return "submit: " + sent.error().message;
  if (const Status sent = driver_.submit_commit(fraction); !sent.ok())
    return "submit_commit: " + sent.error().message;
  if (const Status sent = driver_.submit(step); !sent.ok()) return "submit: " + sent.error().message;
  between();
  bool accepted = false;
  if (std::string wrong = check(trial, driver_.next_answer(), accepted); !wrong.empty()) return wrong;
  const auto committed = driver_.next_answer();
  if (committed.ok() && !committed.value().commit) return "a commit was answered with something else";
  if (std::string wrong =
          check_commit(fraction, committed.ok() ? Result<CommitResult>(*committed.value().commit)
                                                : Result<CommitResult>(committed.error()));
      !wrong.empty())
    return wrong;
  const auto stepped = driver_.next_answer();
  if (accepted) return check(step, stepped, accepted);
  if (stepped.ok() || stepped.error().code != ErrorCode::kFailedPrecondition)
    return "a frame after one that was refused must be refused as out of order";
  return "";
}

std::string RemoteSession::near(const testing::NearOperation& operation, const Around& around) {
  const std::string name = to_string(Operation(operation));
  std::optional<Result<client::Answer>> answer;
  around([&] { answer.emplace(driver_.proximity(operation)); });
  if (operation.where == Where::kTrialEnd && !state_.trial) {
    if (!answer->ok() && answer->error().code == ErrorCode::kFailedPrecondition) return "";
    return name + " of no trial: " + (answer->ok() ? "answered" : answer->error().message);
  }
  const Outcome expected = state_.brute_force(operation, options_);
  if (!answer->ok()) {
    if (answer->error().code == ErrorCode::kResourceExhausted && expected.contacts.size() > few_) return "";
    if (answer->error().code == ErrorCode::kInvalidArgument && expected.refused(ErrorCode::kInvalidArgument))
      return "";
    return name + ": " + answer->error().message;
  }
  if (!expected.done()) return name + ": answered, and it is wrong";
  const ContactFields fields = merged(options_, operation.question()).fields;
  const std::string differs =
      difference(answer->value(), expected, Scene::create(state_.scene).value(), fields);
  return differs.empty() ? "" : name + ": " + differs;
}

std::string RemoteSession::add(const AddOperation& add, const Around& around) {
  std::optional<Result<std::uint32_t>> index;
  around([&] { index.emplace(driver_.add_body(add)); });
  if (!index->ok()) return "add_body: " + index->error().message;
  if (index->value() != state_.scene.bodies.size())
    return "add_body: index " + std::to_string(index->value()) + " where " +
           std::to_string(state_.scene.bodies.size()) + " is expected";
  state_.accept(add);
  return "";
}

std::string RemoteSession::change(const ChangeOperation& change, const Around& around) {
  state_.trial.reset();
  const bool removed = state_.scene.bodies[change.body].kind == BodyKind::kRemoved;
  Status changed;
  around([&] { changed = driver_.change_body(change.body, change.as); });
  if (removed) {
    if (!changed.ok() && changed.error().code == ErrorCode::kInvalidArgument) return "";
    return "a change of a body that was removed: " + (changed.ok() ? "taken" : changed.error().message);
  }
  // Where its vertices are is no float32.
  const bool settles = change.as.kind != BodyKind::kRigid && change.as.kind != BodyKind::kRemoved &&
                       !state_.scene.bodies[change.body].half_space;
  if (driver_.single() && settles && state_.pose[change.body])
    return !changed.ok() && changed.error().code == ErrorCode::kFailedPrecondition
               ? ""
               : "change_body of a body at a pose: " + (changed.ok() ? "taken" : changed.error().message);
  if (!changed.ok()) return "change_body: " + changed.error().message;
  state_.accept(change);
  return "";
}

std::string RemoteSession::change_filters(const PairFilters& filters, const Around& around) {
  state_.trial.reset();
  Status changed;
  around([&] { changed = driver_.change_filters(filters); });
  if (!changed.ok()) return "change_filters: " + changed.error().message;
  state_.accept(testing::ChangesOperation{{ChangeFilters{filters}}});
  return "";
}

std::string RemoteSession::change_excluded_pairs(const ChangeExcludedPairs& other, const Around& around) {
  state_.trial.reset();
  Status changed;
  around([&] { changed = driver_.change_excluded_pairs(other.pairs); });
  if (!changed.ok()) return "change_excluded_pairs: " + changed.error().message;
  state_.accept(testing::ChangesOperation{{other}});
  return "";
}

std::string RemoteSession::change_options(const ColliderOptions& options, const Around& around) {
  state_.trial.reset();
  Status changed;
  around([&] { changed = driver_.change_options(options); });
  if (!changed.ok()) return "change_options: " + changed.error().message;
  options_ = options;
  return "";
}

std::string RemoteSession::wrong_options() {
  ColliderOptions options = options_;
  options.find_bodies = !options.find_bodies;
  const Status changed = driver_.change_options(options);
  state_.trial.reset();
  if (!changed.ok() && changed.error().code == ErrorCode::kInvalidArgument) return "";
  return "wrong options: " + (changed.ok() ? "taken" : changed.error().message);
}

std::string RemoteSession::replace(const SceneChange& change, const Around& around) {
  state_.trial.reset();
  Status changed;
  around([&] {
    if (const auto* elements = std::get_if<ReplaceElements>(&change)) changed = driver_.replace(*elements);
    if (const auto* body = std::get_if<ReplaceBody>(&change)) changed = driver_.replace(*body);
  });
  if (!changed.ok()) return "a replacement: " + changed.error().message;
  state_.accept(testing::ChangesOperation{{change}});
  return "";
}

std::string RemoteSession::wrong_replacement() {
  const auto bodies = static_cast<std::uint32_t>(state_.scene.bodies.size());
  const Status changed = driver_.replace(ReplaceElements{
      bodies == 0 ? 0 : bodies - 1, {{0, 1, static_cast<std::int32_t>(state_.scene.vertex_count)}}, {}});
  state_.trial.reset();
  if (!changed.ok() && changed.error().code == ErrorCode::kInvalidArgument) return "";
  return "a wrong replacement: " + (changed.ok() ? "taken" : changed.error().message);
}

std::string RemoteSession::check_state() const {
  const Result<SessionDriver::State> told = driver_.state();
  if (!told) return "where everything is: " + told.error().message;
  return state_.difference(told.value().positions, told.value().poses, false);
}

std::string RemoteSession::wrong_step(const StepOperation& operation) {
  const auto answer = driver_.step(operation);
  state_.trial.reset();
  if (!answer.ok() && answer.error().code == ErrorCode::kInvalidArgument) return "";
  return "a wrong frame: " + (answer.ok() ? "answered" : answer.error().message);
}

std::string RemoteSession::wrong_change() {
  const auto nobody = static_cast<std::uint32_t>(state_.scene.bodies.size()) + 3;
  Body body;
  body.vertex_count = 1;
  const Status changed = driver_.change_body(nobody, body);
  state_.trial.reset();
  // Without declared bodies there is nothing to change at all.
  if (!changed.ok() && (changed.error().code == ErrorCode::kInvalidArgument ||
                        changed.error().code == ErrorCode::kFailedPrecondition))
    return "";
  return "a wrong change: " + (changed.ok() ? "taken" : changed.error().message);
}

std::string RemoteSession::wrong_filters() {
  const Status changed = driver_.change_filters({.excluded_vertex_pairs = {{0, state_.scene.vertex_count}}});
  state_.trial.reset();
  if (!changed.ok() && changed.error().code == ErrorCode::kInvalidArgument) return "";
  return "wrong filters: " + (changed.ok() ? "taken" : changed.error().message);
}

std::string RemoteSession::close() {
  const Status closed = driver_.close();
  // A daemon that was killed knows of none; one that cannot be reached is given up soon.
  if (closed.ok() || closed.error().code == ErrorCode::kNotFound ||
      closed.error().code == ErrorCode::kUnavailable)
    return "";
  return "close: " + closed.error().message;
}

}  // namespace warmfront::test
