// SPDX-License-Identifier: Apache-2.0
#include "client/c/reading.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "client/c/arrays.h"
#include "client/c/structs.h"

namespace warmfront::c {
namespace {

// Both lists have the same numbers.
static_assert(WF_REMOVED == static_cast<int>(BodyKind::kRemoved));
static_assert(WF_EXACT == static_cast<int>(Tier::kExact));
static_assert(WF_ANY == static_cast<int>(Report::kAny));
static_assert(WF_TRIAL_END == static_cast<int>(Where::kTrialEnd));

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

Result<std::vector<Body>> bodies_of(const wf_scene& scene) {
  std::vector<Body> bodies;
  std::uint32_t first_vertex = 0;
  const auto* at = reinterpret_cast<const char*>(scene.bodies);
  if (at == nullptr && scene.body_count > 0)
    return invalid_argument("bodies: is null; give an array of wf_body");
  for (std::size_t b = 0; b < scene.body_count; ++b) {
    const std::string where = "bodies[" + std::to_string(b) + "]";
    // The caller's array has structs of the caller's size.
    std::size_t size = 0;
    Result<Body> given = body_of(reinterpret_cast<const wf_body*>(at), where, size);
    if (!given) return given.error();
    at += size;
    Body body = std::move(given).value();
    body.first_vertex = first_vertex;
    first_vertex += body.vertex_count;
    bodies.push_back(std::move(body));
  }
  return bodies;
}

}  // namespace

Result<Body> body_of(const wf_body* given, const std::string& where, std::size_t& size) {
  const Result<wf_body> taken = read(given, initial_body(), "body");
  if (!taken) return Error{taken.error().code, where + ": " + taken.error().message};
  const wf_body& from = taken.value();
  size = from.size;
  Body body;
  if (from.name != nullptr) body.name = from.name;
  body.vertex_count = from.vertex_count;
  if (Status known = choose(where + ".kind", from.kind, BodyKind::kRemoved, body.kind); !known)
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
  return body;
}

Error out_of(const std::string& field, std::int64_t value, int last) {
  return invalid_argument(field + ": " + std::to_string(value) + " is not in [0, " + std::to_string(last) +
                          "]");
}

Result<Positions> positions(const void* first, std::size_t count, bool float32, const std::string& field) {
  if (float32) {
    const auto given = rows(static_cast<const float*>(first), count, field);
    if (!given) return given.error();
    return Positions(given.value());
  }
  const auto given = rows(static_cast<const double*>(first), count, field);
  if (!given) return given.error();
  return Positions(given.value());
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
  Result<PairFilters> filters = filters_of(from);
  if (!filters) return filters.error();
  scene.filters = std::move(filters).value();
  scene.filters.rest_at(at);
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
    into.poses.push_back({posed.value()[i], pose});
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

}  // namespace warmfront::c
