// SPDX-License-Identifier: Apache-2.0
// The C interface over a session in this process. Thread safety as stated in the header.
#include "client/c/warmfront.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "client/lib/local_session.h"
#include "proto/wire/codes.h"

using warmfront::client::LocalSession;

// Both lists have the same numbers.
static_assert(WF_REMOVED == static_cast<int>(warmfront::BodyKind::kRemoved));
static_assert(WF_EXACT == static_cast<int>(warmfront::Tier::kExact));
static_assert(WF_ANY == static_cast<int>(warmfront::Report::kAny));
static_assert(WF_VERTEX_HALF_SPACE == static_cast<int>(warmfront::ContactKind::kVertexHalfSpace));
static_assert(WF_BUDGET == static_cast<int>(warmfront::ContactStatus::kBudget));
static_assert(WF_TRIAL_END == static_cast<int>(warmfront::Where::kTrialEnd));

struct wf_flag {
  std::atomic<bool> value{false};
};

struct wf_session {
  wf_session(warmfront::Collider collider, bool single)
      : float32(single),
        local(std::make_shared<LocalSession>(
            std::move(collider), single ? warmfront::Rounding::kFloat32 : warmfront::Rounding::kFloat64)) {}

  bool float32;
  std::shared_ptr<LocalSession> local;
  // Of the last answer.
  warmfront::client::Answer answer;
  std::vector<std::array<std::uint32_t, 2>> features;
};

namespace {

using namespace warmfront;

// Of a fixed size, so that there is always room to say that there is no memory.
thread_local char last_error[2048] = "";

wf_code fail(wf_code code, const char* text) noexcept {
  static_cast<void>(std::snprintf(last_error, sizeof last_error, "%s", text));
  return code;
}
wf_code fail(const Error& error) noexcept {
  return fail(wire::canonical_code(error.code), error.message.c_str());
}

/// f(), which returns a code, and what it throws as one.
template <class F>
wf_code guarded(F f) noexcept {
  try {
    return f();
  } catch (const std::bad_alloc&) {
    return fail(WF_RESOURCE_EXHAUSTED, "there is no memory for it now; everything is as before");
  } catch (const std::exception& error) {
    return fail(WF_INTERNAL, error.what());
  } catch (...) {
    return fail(WF_INTERNAL, "an exception without words");
  }
}

/// Sets what a caller's struct has room for.
template <class T>
void initialize(T* to, std::size_t size, T initial) {
  if (to == nullptr) return;
  initial.size = size;
  std::memcpy(static_cast<void*>(to), &initial, std::min(size, sizeof initial));
}

/// What a caller gave, where its struct ends before this library's: the rest as it is initially.
template <class T>
Result<T> read(const T* given, T initial, const char* what) {
  if (given == nullptr) return initial;
  std::size_t size = 0;
  std::memcpy(&size, given, sizeof size);
  if (size < sizeof size)
    return invalid_argument(std::string(what) + ".size: is " + std::to_string(size) +
                            "; initialize the struct with wf_" + what + "_init(&it, sizeof it)");
  std::memcpy(static_cast<void*>(&initial), given, std::min(size, sizeof initial));
  return initial;
}

wf_body initial_body() {
  wf_body body{};
  body.self_collision = 1;
  body.group = 1;
  body.mask = 0xffffffff;
  return body;
}
wf_options initial_options() {
  const ColliderOptions defaults;
  wf_options options{};
  options.tier = static_cast<std::int32_t>(defaults.tier);
  options.report = static_cast<std::int32_t>(defaults.report);
  options.tolerance = defaults.tolerance;
  options.min_separation = defaults.min_separation;
  options.max_contacts = defaults.max_contacts;
  options.max_front_bytes = defaults.max_front_bytes;
  return options;
}
wf_question initial_question() {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  wf_question question{};
  question.tier = question.report = -1;
  question.fields = -1;
  question.tolerance = question.min_separation = question.keep_distance = kNone;
  question.max_contacts = UINT64_MAX;
  return question;
}

Error out_of(const std::string& field, std::int64_t value, int last) {
  return invalid_argument(field + ": " + std::to_string(value) + " is not in [0, " + std::to_string(last) +
                          "]");
}
template <class Enum>
Status choose(const std::string& field, std::int32_t value, Enum last, Enum& into) {
  if (value < 0 || value > static_cast<int>(last)) return out_of(field, value, static_cast<int>(last));
  into = static_cast<Enum>(value);
  return {};
}

constexpr std::uint32_t kAllFields = 63;

Status choose_fields(const std::string& field, std::int64_t bits, ContactFields& into) {
  if (bits < 0 || bits > kAllFields) return out_of(field, bits, kAllFields);
  into = {.weights = (bits & WF_WEIGHTS) != 0,
          .normal = (bits & WF_NORMAL) != 0,
          .points = (bits & WF_POINTS) != 0,
          .direction = (bits & WF_DIRECTION) != 0,
          .squared_distance = (bits & WF_SQUARED_DISTANCE) != 0,
          .closest = (bits & WF_CLOSEST) != 0};
  return {};
}

/// An array of so many rows, or none; kInvalidArgument for rows without an array.
template <class T>
Result<std::span<const T>> rows(const T* first, std::size_t count, const char* field) {
  if (first == nullptr && count > 0)
    return invalid_argument(std::string(field) + ": is null, and " + std::to_string(count) +
                            " numbers are expected");
  return std::span<const T>(first, first == nullptr ? 0 : count);
}
Result<Positions> positions(const void* first, std::size_t count, bool float32, const char* field) {
  if (float32) {
    const auto given = rows(static_cast<const float*>(first), count, field);
    if (!given) return given.error();
    return Positions(given.value());
  }
  const auto given = rows(static_cast<const double*>(first), count, field);
  if (!given) return given.error();
  return Positions(given.value());
}
template <class Row>
Status copy_rows(const typename Row::value_type* first, std::size_t count, const char* field,
                 std::vector<Row>& into) {
  const auto given = rows(first, count * std::tuple_size_v<Row>, field);
  if (!given) return given.error();
  into.resize(count);
  if (count > 0) std::memcpy(into.data(), first, count * sizeof(Row));
  return {};
}
template <class T>
void copy_optional(const T* first, std::size_t count, std::vector<T>& into) {
  if (first != nullptr) into.assign(first, first + count);
}

Result<std::vector<Body>> bodies_of(const wf_scene& scene) {
  std::vector<Body> bodies;
  std::uint32_t first_vertex = 0;
  const auto* at = reinterpret_cast<const char*>(scene.bodies);
  if (at == nullptr && scene.body_count > 0)
    return invalid_argument("bodies: is null; give an array of wf_body");
  for (std::size_t b = 0; b < scene.body_count; ++b) {
    // The caller's array has structs of the caller's size.
    Result<wf_body> given = read(reinterpret_cast<const wf_body*>(at), initial_body(), "body");
    if (!given) return invalid_argument("bodies[" + std::to_string(b) + "]: " + given.error().message);
    const wf_body& from = given.value();
    at += from.size;
    Body body;
    if (from.name != nullptr) body.name = from.name;
    body.first_vertex = first_vertex;
    body.vertex_count = from.vertex_count;
    first_vertex += from.vertex_count;
    if (Status known =
            choose("bodies[" + std::to_string(b) + "].kind", from.kind, BodyKind::kRemoved, body.kind);
        !known)
      return known.error();
    body.self_collision = from.self_collision != 0;
    body.group = from.group;
    body.mask = from.mask;
    body.world = from.world;
    body.thickness = from.thickness;
    body.screw = from.screw != 0;
    if (from.is_half_space != 0) {
      HalfSpace& half_space = body.half_space.emplace();
      std::copy(from.point, from.point + 3, half_space.point.begin());
      std::copy(from.normal, from.normal + 3, half_space.normal.begin());
    }
    bodies.push_back(std::move(body));
  }
  return bodies;
}

Result<SceneDescription> scene_of(const wf_scene& from, const Positions& at) {
  SceneDescription scene;
  scene.vertex_count = from.vertex_count;
  if (Status taken = copy_rows(from.faces, from.face_count, "faces", scene.faces); !taken)
    return taken.error();
  if (Status taken = copy_rows(from.edges, from.edge_count, "edges", scene.edges); !taken)
    return taken.error();
  Result<std::vector<Body>> bodies = bodies_of(from);
  if (!bodies) return bodies.error();
  scene.bodies = std::move(bodies).value();
  if (Status taken =
          copy_rows(from.excluded_pairs, from.excluded_pair_count, "excluded_pairs", scene.excluded_pairs);
      !taken)
    return taken.error();
  copy_optional(from.thickness, from.vertex_count, scene.thickness);
  PairFilters& filters = scene.filters;
  filters.within_edges = from.within_edges;
  filters.near_at_rest = from.near_at_rest;
  copy_optional(from.rest_positions, std::size_t{3} * from.vertex_count, filters.rest_positions);
  if (Status taken = copy_rows(from.excluded_vertex_pairs, from.excluded_vertex_pair_count,
                               "excluded_vertex_pairs", filters.excluded_vertex_pairs);
      !taken)
    return taken.error();
  copy_optional(from.patches, from.vertex_count, filters.patches);
  filters.rest_at(at);
  return scene;
}

Result<ColliderOptions> options_of(const wf_options& from) {
  ColliderOptions options;
  if (Status known = choose("options.tier", from.tier, Tier::kExact, options.tier); !known)
    return known.error();
  if (Status known = choose("options.report", from.report, Report::kCandidates, options.report); !known)
    return known.error();
  if (Status known = choose_fields("options.fields", from.fields, options.fields); !known)
    return known.error();
  options.tolerance = from.tolerance;
  options.min_separation = from.min_separation;
  options.max_contacts = from.max_contacts;
  options.max_front_bytes = from.max_front_bytes;
  return options;
}

/// A frame's parts, where they are.
struct GivenFrame {
  Frame frame;
  std::vector<BodyPositions> bodies;
  std::vector<BodyPose> poses;
};

Status take_frame(const wf_session& session, const wf_frame* given, GivenFrame& into) {
  const Result<wf_frame> read_frame = read(given, wf_frame{}, "frame");
  if (!read_frame) return read_frame.error();
  const wf_frame& from = read_frame.value();
  const Scene& scene = session.local->collider().scene();
  if (from.positions != nullptr) {
    Result<Positions> all =
        positions(from.positions, std::size_t{3} * scene.vertex_count(), session.float32, "positions");
    if (!all) return all.error();
    into.frame.positions = all.value();
  }
  const Result<std::span<const std::uint32_t>> bodies = rows(from.bodies, from.body_count, "bodies");
  if (!bodies) return bodies.error();
  std::size_t at = 0;  // numbers before
  for (const std::uint32_t body : bodies.value()) {
    if (body >= scene.bodies().size())
      return invalid_argument("bodies: body " + std::to_string(body) + " is not in [0, " +
                              std::to_string(scene.bodies().size()) + ")");
    const std::size_t count = std::size_t{3} * scene.bodies()[body].vertex_count;
    const auto* first = static_cast<const char*>(from.body_positions);
    if (first != nullptr) first += at * (session.float32 ? sizeof(float) : sizeof(double));
    Result<Positions> these = positions(first, count, session.float32, "body_positions");
    if (!these) return these.error();
    into.bodies.push_back({body, these.value()});
    at += count;
  }
  const Result<std::span<const std::uint32_t>> posed = rows(from.pose_bodies, from.pose_count, "pose_bodies");
  if (!posed) return posed.error();
  const Result<std::span<const double>> poses = rows(from.poses, 12 * from.pose_count, "poses");
  if (!poses) return poses.error();
  for (std::size_t i = 0; i < from.pose_count; ++i) {
    Pose pose;
    std::ranges::copy(poses.value().subspan(12 * i, 12), pose.matrix.begin());
    into.poses.push_back({posed.value()[i], session.float32 ? in_float32(pose) : pose});
  }
  const Result<std::span<const std::uint32_t>> vertices = rows(from.vertices, from.vertex_count, "vertices");
  if (!vertices) return vertices.error();
  Result<Positions> these =
      positions(from.vertex_positions, 3 * from.vertex_count, session.float32, "vertex_positions");
  if (!these) return these.error();
  into.frame.bodies = into.bodies;
  into.frame.poses = into.poses;
  into.frame.vertices = vertices.value();
  into.frame.vertex_positions = these.value();
  return {};
}

Result<Question> question_of(QuestionKind kind, const wf_question& from) {
  Question question{.kind = kind};
  QuestionOptions& options = question.options;
  if (from.tier != -1) {
    if (Status known = choose("question.tier", from.tier, Tier::kExact, options.tier.emplace()); !known)
      return known.error();
  }
  if (from.report != -1) {
    if (Status known = choose("question.report", from.report, Report::kAny, options.report.emplace()); !known)
      return known.error();
  }
  if (from.fields != -1) {
    if (Status known = choose_fields("question.fields", from.fields, options.fields.emplace()); !known)
      return known.error();
  }
  if (!std::isnan(from.tolerance)) options.tolerance = from.tolerance;
  if (!std::isnan(from.min_separation)) options.min_separation = from.min_separation;
  if (!std::isnan(from.keep_distance)) options.keep_distance = from.keep_distance;
  if (from.max_contacts != UINT64_MAX) options.max_contacts = from.max_contacts;
  options.reduced = from.reduced != 0;
  question.leave_out_overlaps = from.leave_out_overlaps != 0;
  if (Status known = choose("question.where", from.where, Where::kTrialEnd, question.where); !known)
    return known.error();
  const auto only = [](const char* field, const char* of) {
    return invalid_argument(std::string("question.") + field + ": it is of " + of + " only");
  };
  if (question.where != Where::kBase && !question.of_state())
    return only("where", "wf_proximity(), wf_vertex_distances() and wf_intersections()");
  if (kind != QuestionKind::kMaxStep && question.leave_out_overlaps)
    return only("leave_out_overlaps", "wf_max_step()");
  if (kind != QuestionKind::kMaxStep && options.keep_distance) return only("keep_distance", "wf_max_step()");
  return question;
}

template <class T, class Column>
const T* column(const Column& values) {
  return values.empty() ? nullptr : reinterpret_cast<const T*>(values.data());
}

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
  std::memcpy(static_cast<void*>(answer), &to, std::min(size, sizeof to));
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

extern "C" {

const char* wf_last_error(void) {
  return last_error;
}
const char* wf_version(void) {
  return WARMFRONT_VERSION;
}

void wf_body_init(wf_body* body, size_t size) {
  initialize(body, size, initial_body());
}
void wf_scene_init(wf_scene* scene, size_t size) {
  initialize(scene, size, wf_scene{});
}
void wf_options_init(wf_options* options, size_t size) {
  initialize(options, size, initial_options());
}
void wf_frame_init(wf_frame* frame, size_t size) {
  initialize(frame, size, wf_frame{});
}
void wf_question_init(wf_question* question, size_t size) {
  initialize(question, size, initial_question());
}

wf_code wf_create(const wf_scene* scene, const wf_options* options, wf_session** session) {
  if (session == nullptr) return fail(WF_INVALID_ARGUMENT, "session: is null; give where to put it");
  *session = nullptr;
  return guarded([&]() -> wf_code {
    if (scene == nullptr) return fail(WF_INVALID_ARGUMENT, "scene: is null");
    const Result<wf_scene> from = read(scene, wf_scene{}, "scene");
    if (!from) return fail(from.error());
    const Result<wf_options> chosen = read(options, initial_options(), "options");
    if (!chosen) return fail(chosen.error());
    const Result<ColliderOptions> taken = options_of(chosen.value());
    if (!taken) return fail(taken.error());
    const std::int32_t type = from.value().type;
    if (type != WF_FLOAT64 && type != WF_FLOAT32) return fail(out_of("type", type, WF_FLOAT32));
    const bool float32 = type == WF_FLOAT32;
    const Result<Positions> at =
        positions(from.value().positions, std::size_t{3} * from.value().vertex_count, float32, "positions");
    if (!at) return fail(at.error());
    Result<SceneDescription> description = scene_of(from.value(), at.value());
    if (!description) return fail(description.error());
    Result<Scene> made = Scene::create(std::move(description).value());
    if (!made) return fail(made.error());
    // All sessions share those of the process.
    static const auto* shared = new std::shared_ptr<Workers>(std::make_shared<Workers>(0));
    constexpr std::uint32_t kMostThreads = 1024;
    const std::uint32_t threads = chosen.value().threads;
    if (threads > kMostThreads) return fail(out_of("options.threads", threads, kMostThreads));
    Result<Collider> collider =
        Collider::create(std::make_shared<const Scene>(std::move(made).value()), at.value(), taken.value(),
                         threads == 0 ? *shared : std::make_shared<Workers>(static_cast<int>(threads)));
    if (!collider) return fail(collider.error());
    *session = new wf_session(std::move(collider).value(), float32);
    return WF_OK;
  });
}
void wf_free(wf_session* session) {
  delete session;
}

wf_code wf_flag_create(wf_flag** flag) {
  if (flag == nullptr) return fail(WF_INVALID_ARGUMENT, "flag: is null; give where to put it");
  *flag = nullptr;
  return guarded([&]() -> wf_code {
    *flag = new wf_flag;
    return WF_OK;
  });
}
void wf_flag_set(wf_flag* flag, int32_t value) {
  if (flag != nullptr) flag->value.store(value != 0, std::memory_order_relaxed);
}
void wf_flag_free(wf_flag* flag) {
  delete flag;
}

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

wf_code wf_positions(const wf_session* session, double* to, size_t count) {
  return guarded([&]() -> wf_code {
    if (session == nullptr || to == nullptr)
      return fail(WF_INVALID_ARGUMENT, "session or positions: is null");
    const std::vector<double> at = session->local->collider().positions();
    if (count < at.size())
      return fail(invalid_argument("count: " + std::to_string(count) + " numbers have room, and " +
                                   std::to_string(at.size()) + " are needed"));
    std::ranges::copy(at, to);
    return WF_OK;
  });
}
wf_code wf_edges(const wf_session* session, const uint32_t** edges, size_t* edge_count) {
  if (session == nullptr || edges == nullptr || edge_count == nullptr)
    return fail(WF_INVALID_ARGUMENT, "session, edges or edge_count: is null");
  const std::span<const Edge> all = session->local->collider().scene().edges();
  *edges = column<std::uint32_t>(all);
  *edge_count = all.size();
  return WF_OK;
}
}
