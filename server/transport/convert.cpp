// SPDX-License-Identifier: Apache-2.0
// Messages to values and back. Thread-safe.
#include "server/transport/convert.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "server/units.h"

namespace warmfront::server {
namespace {

Fault bad_enum(const std::string& field, int value) {
  return {ErrorCode::kInvalidArgument, Reason::kInvalidInput,
          field + ": value " + std::to_string(value) +
              " is unknown to this daemon; see its enum in warmfront.v1"};
}

Fault bad_bytes(const std::string& field, std::size_t bytes, std::size_t expected, const std::string& of) {
  return {ErrorCode::kInvalidArgument, Reason::kInvalidInput,
          field + ": " + std::to_string(bytes) + " bytes, but " + std::to_string(expected) +
              " are expected for " + of};
}

Outcome<std::vector<BodyPose>> poses_from(const v1::SessionHeader& header) {
  if (header.pose_bodies().size() % 4 != 0)
    return bad_bytes("pose_bodies", header.pose_bodies().size(), header.pose_bodies().size() / 4 * 4,
                     "a whole number of uint32");
  std::vector<BodyPose> poses(header.pose_bodies().size() / 4);
  constexpr std::size_t kPoseBytes = 12 * sizeof(double);
  if (header.poses().size() != kPoseBytes * poses.size())
    return bad_bytes("poses", header.poses().size(), kPoseBytes * poses.size(),
                     std::to_string(poses.size()) + " bodies");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    std::memcpy(&poses[i].body, header.pose_bodies().data() + 4 * i, 4);
    std::memcpy(poses[i].pose.matrix.data(), header.poses().data() + kPoseBytes * i, kPoseBytes);
  }
  return poses;
}

/// At least what change_order_from() makes of the changes: vectors that are as long as what they are made of.
std::size_t bytes_of_changes(const v1::ChangeSceneRequest& request, Dtype dtype) {
  constexpr std::size_t kAllocator = 32;  // adds no more to each
  const auto array = [](std::size_t bytes) { return bytes > 0 ? bytes + kAllocator : 0; };
  const auto body = [&](const v1::BodyAddition& add) {
    return array(add.body().name().size()) + array(add.faces().size()) + array(add.edges().size()) +
           array(add.thickness().size()) + array(add.positions().size() / size_of(dtype) * sizeof(double));
  };
  std::size_t bytes = array(request.key().size());
  for (const v1::SceneChange& change : request.changes()) {
    bytes += sizeof(SceneChange);
    if (change.has_add()) {
      bytes += body(change.add());
    } else if (change.has_replace_body()) {
      bytes += body(change.replace_body().with());
    } else if (change.has_replace_elements()) {
      bytes +=
          array(change.replace_elements().faces().size()) + array(change.replace_elements().edges().size());
    } else if (change.has_change()) {
      bytes += array(change.change().body().name().size());
    } else if (change.has_change_filters()) {
      const v1::PairFilters& filters = change.change_filters();
      bytes += array(filters.rest_positions().size()) + array(filters.excluded_vertex_pairs().size()) +
               array(filters.patches().size());
    } else if (change.has_change_excluded_pairs()) {
      bytes += array(static_cast<std::size_t>(change.change_excluded_pairs().pairs_size()) *
                     sizeof(std::array<std::uint32_t, 2>));
    }
  }
  return bytes;
}

template <class T>
void set_bytes(std::string& bytes, const std::vector<T>& column, std::size_t first, std::size_t count) {
  bytes.assign(reinterpret_cast<const char*>(column.data() + first), count * sizeof(T));
}

}  // namespace

Outcome<ColliderOptions> options_from(const v1::ColliderOptions& message, const Limits& limits) {
  Result<ColliderOptions> read = wire::options_from(message);
  if (!read) return fault_from(read.error());
  ColliderOptions options = std::move(read).value();
  // The two parts of a session that grow with its motion: each may take up a part of what a session may hold,
  // so that a step knows its bound before it begins.
  options.max_front_bytes = std::min({options.max_front_bytes, limits.max_front_bytes,
                                      growing_part(limits.max_session_bytes, options.explain)});
  options.max_contacts = std::min({options.max_contacts, limits.max_contacts,
                                   most_contacts(limits.max_session_bytes, options.explain, options.fields)});
  if (Status valid = validate(options); !valid) return fault_from(valid.error(), "options: ");
  return options;
}

Outcome<Dtype> dtype_from(v1::Dtype dtype) {
  switch (dtype) {
    case v1::DTYPE_FLOAT32:
      return Dtype::kFloat32;
    case v1::DTYPE_FLOAT64:
      return Dtype::kFloat64;
    case v1::DTYPE_UNSPECIFIED:
      return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                   "dtype: it must be stated, float32 or float64"};
    default:
      return bad_enum("dtype", dtype);
  }
}

Outcome<Session::Claim> claim_from(const v1::Attach& message) {
  constexpr std::size_t kLongestClientId = 64;
  const auto wrong = [](std::string what) {
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput, "attach: " + std::move(what)};
  };
  if (message.client_id().size() > kLongestClientId)
    return wrong("client_id has " + std::to_string(message.client_id().size()) +
                 " bytes; at most 64 are allowed, and a UUID has 36");
  if (message.client_id().empty() != (message.attempt() == 0))
    return wrong("client_id and attempt are of use only together; send both, or neither");
  return Session::Claim{message.takeover(), message.client_id(), message.attempt()};
}

Outcome<SessionSpec> spec_from(const v1::SessionHeader& header, const Limits& limits) {
  Outcome<SessionId> id = SessionId::parse(header.session_id());
  if (!id) return id.fault();
  Outcome<Dtype> dtype = dtype_from(header.dtype());
  if (!dtype) return dtype.fault();
  Outcome<ColliderOptions> options = options_from(header.options(), limits);
  if (!options) return options.fault();
  if (header.vertex_count() > limits.max_vertices)
    return too_large("vertex_count", header.vertex_count(), limits.max_vertices, "max-vertices");
  const std::uint64_t elements = std::uint64_t{header.face_count()} + header.edge_count();
  if (elements > limits.max_triangles)
    return too_large(header.edge_count() > 0 ? "face_count and edge_count" : "face_count", elements,
                     limits.max_triangles, "max-triangles");
  if (header.first_frame() >> 63 != 0)
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 "first_frame: " + std::to_string(header.first_frame()) + " is not below 2^63"};

  SessionSpec spec{std::move(id).value(), {}, options.value(), dtype.value(), header.first_frame(), {}};
  spec.scene.vertex_count = header.vertex_count();
  spec.scene.bodies.reserve(static_cast<std::size_t>(header.bodies_size()));
  for (int i = 0; i < header.bodies_size(); ++i) {
    Result<Body> body = wire::body_from(header.bodies(i), "bodies[" + std::to_string(i) + "]");
    if (!body) return fault_from(body.error());
    spec.scene.bodies.push_back(std::move(body).value());
  }
  spec.scene.excluded_pairs = wire::body_pairs_from(header.excluded_pairs());
  Outcome<std::vector<BodyPose>> poses = poses_from(header);
  if (!poses) return poses.fault();
  spec.poses = std::move(poses).value();
  spec.first_revision = header.first_revision();
  v1::SessionHeader said = header;
  said.clear_session_id();
  StateDigest digest(0);
  digest.add(said.SerializeAsString());
  spec.header_digest = digest.value();
  return spec;
}

Outcome<ChangeOrder> change_order_from(const v1::ChangeSceneRequest& request, Dtype dtype,
                                       const Limits& limits, std::shared_ptr<Account> account) {
  constexpr std::size_t kLongestKey = 64;
  if (request.key().size() > kLongestKey)
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 "key: " + std::to_string(request.key().size()) + " bytes, but " +
                     std::to_string(kLongestKey) + " at most are expected"};
  const std::size_t bytes = bytes_of_changes(request, dtype);
  if (account) {
    if (std::optional<Fault> refusal = account->refusal(bytes)) {
      refusal->message =
          "changes: " + describe_bytes(bytes) + " while they wait for their turn: " + refusal->message;
      return *std::move(refusal);
    }
  }
  ChangeOrder order;
  order.memory = Holding(std::move(account), bytes);
  order.next_frame = request.next_frame();
  order.key = request.key();
  if (request.has_expected_state())
    order.expected = SessionState{request.expected_state().frame(), request.expected_state().revision(),
                                  request.expected_state().digest()};
  StateDigest digest(0);
  for (const v1::SceneChange& change : request.changes()) digest.add(change.SerializeAsString());
  if (request.has_options()) {
    Outcome<ColliderOptions> options = options_from(request.options(), limits);
    if (!options) return options.fault();
    order.options = options.value();
    digest.add(request.options().SerializeAsString());
  }
  order.digest = digest.value();
  std::vector<SceneChange>& changes = order.changes;
  changes.reserve(static_cast<std::size_t>(request.changes_size()));
  for (int i = 0; i < request.changes_size(); ++i) {
    if (request.changes(i).continues())
      return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                   "changes[" + std::to_string(i) + "].continues: is of StreamChangeScene alone"};
    Result<SceneChange> change =
        wire::change_from(request.changes(i), dtype == Dtype::kFloat32, "changes[" + std::to_string(i) + "]");
    if (!change) return fault_from(change.error());
    changes.push_back(std::move(change).value());
  }
  return order;
}

v1::MovedParts to_proto(const MovedPiece& piece) {
  v1::MovedParts moved;
  moved.mutable_bodies()->assign(piece.bodies);
  moved.mutable_body_positions()->assign(piece.body_positions);
  moved.mutable_pose_bodies()->assign(piece.pose_bodies);
  moved.mutable_poses()->assign(piece.poses);
  moved.mutable_vertices()->assign(piece.vertices);
  moved.mutable_vertex_positions()->assign(piece.vertex_positions);
  return moved;
}

v1::SessionInfo to_proto(const Session& session) {
  const SessionSnapshot snapshot = session.snapshot();
  using std::chrono::duration_cast;
  using std::chrono::milliseconds;
  v1::SessionInfo info;
  info.set_session_id(session.id().text());
  const std::shared_ptr<const Scene> scene = session.scene();
  info.set_vertex_count(scene->vertex_count());
  info.set_face_count(scene->face_count());
  info.set_edge_count(scene->edge_count());
  info.set_lone_edge_count(static_cast<std::uint32_t>(scene->lone_edges().size()));
  info.set_body_count(scene->body_count());
  info.set_dtype(session.dtype() == Dtype::kFloat32 ? v1::DTYPE_FLOAT32 : v1::DTYPE_FLOAT64);
  *info.mutable_options() = to_proto(session.options());
  info.set_last_frame(snapshot.state.frame);
  info.set_steps(snapshot.steps);
  info.set_memory_bytes(snapshot.memory_bytes);
  info.set_attached(snapshot.attached);
  info.set_created_unix_ms(duration_cast<milliseconds>(snapshot.created.time_since_epoch()).count());
  info.set_idle_ms(static_cast<std::uint64_t>(snapshot.idle.count()));
  *info.mutable_state() = to_proto(snapshot.state);
  info.set_most_thickness(scene->most_thickness());
  info.set_world_count(static_cast<std::uint32_t>(world_count(scene->bodies())));
  info.set_screw_count(static_cast<std::uint32_t>(screw_count(scene->bodies())));
  if (scene->filters().any()) *info.mutable_filters() = wire::header_of(scene->filters());
  return info;
}

v1::SessionState to_proto(const SessionState& state) {
  v1::SessionState message;
  message.set_frame(state.frame);
  message.set_revision(state.revision);
  message.set_digest(state.digest);
  return message;
}

v1::Limits to_proto(const Limits& limits, const Quota& quota) {
  v1::Limits message;
  message.set_window(limits.window);
  message.set_max_message_bytes(limits.max_message_bytes);
  message.set_answer_chunk_bytes(limits.answer_chunk_bytes);
  message.set_max_sessions(limits.max_sessions);
  message.set_max_vertices(limits.max_vertices);
  message.set_max_triangles(limits.max_triangles);
  message.set_max_contacts(limits.max_contacts);
  message.set_max_sessions_per_principal(quota.sessions);
  message.set_max_streams_per_principal(quota.streams);
  message.set_max_frames_per_principal(quota.frames);
  message.set_max_uploads_per_principal(quota.uploads);
  message.set_max_session_bytes(limits.max_session_bytes);
  message.set_max_total_bytes(limits.max_total_bytes);
  message.set_max_principal_bytes(quota.bytes);
  message.set_self_check_steps(limits.self_check_steps);
  message.set_max_streams(limits.max_streams_per_connection);
  message.set_max_open_streams(limits.max_open_streams);
  message.set_max_frames_in_flight(limits.max_frames_in_flight);
  message.set_max_queued_bytes(limits.max_queued_bytes);
  message.set_idle_timeout_ms(static_cast<std::uint64_t>(limits.idle_timeout.count()));
  message.set_upload_timeout_ms(static_cast<std::uint64_t>(limits.upload_timeout.count()));
  message.set_write_stall_timeout_ms(static_cast<std::uint64_t>(limits.write_stall_timeout.count()));
  return message;
}

v1::StepSummary summary_of(const Answer& answer) {
  v1::StepSummary summary;
  summary.set_vf(answer.vf);
  summary.set_ee(answer.ee);
  summary.set_ve(answer.ve);
  summary.set_vv(answer.vv);
  summary.set_ef(answer.ef);
  summary.set_vh(answer.vh);
  summary.set_possible(answer.possible);
  if (answer.earliest_toi) summary.set_earliest_toi(*answer.earliest_toi);
  summary.set_rows(answer.rows());
  summary.set_distances(answer.vertex_distances.size());
  summary.set_worlds(answer.worlds.size());
  *summary.mutable_statistics() = to_proto(answer.statistics);
  if (answer.all_deformable) {
    v1::AllDeformable& all = *summary.mutable_all_deformable();
    *all.mutable_statistics() = to_proto(answer.all_deformable->statistics);
    all.set_frame_bytes(answer.all_deformable->frame_bytes);
    all.set_positions_bytes(answer.all_deformable->positions_bytes);
  }
  summary.set_queue_ms(answer.queue_ms);
  summary.set_overlaps_at_start(answer.overlaps_at_start);
  if (answer.keep_distance) summary.set_keep_distance(*answer.keep_distance);
  summary.set_commit_counted(answer.commit_counted);
  *summary.mutable_state() = to_proto(answer.state);
  *summary.mutable_state_before() = to_proto(answer.state_before);
  return summary;
}

void fill_columns(const Answer& answer, std::size_t first, std::size_t count, v1::ContactColumns& columns) {
  set_bytes(*columns.mutable_kind(), answer.kind, first, count);
  set_bytes(*columns.mutable_status(), answer.status, first, count);
  if (answer.edge_faces.empty())
    set_bytes(*columns.mutable_v(), answer.vertices, first, count);
  else
    set_bytes(*columns.mutable_v(), answer.edge_faces, first, count);
  set_bytes(*columns.mutable_toi(), answer.toi, first, count);
  if (!answer.weights.empty()) set_bytes(*columns.mutable_weights(), answer.weights, first, count);
  if (!answer.normal.empty()) set_bytes(*columns.mutable_normal(), answer.normal, first, count);
  if (!answer.points.empty()) set_bytes(*columns.mutable_points(), answer.points, first, count);
  if (!answer.direction.empty()) set_bytes(*columns.mutable_direction(), answer.direction, first, count);
  if (!answer.squared_distance.empty())
    set_bytes(*columns.mutable_squared_distance(), answer.squared_distance, first, count);
  if (!answer.closest.empty()) set_bytes(*columns.mutable_closest(), answer.closest, first, count);
  if (!answer.multiplicity.empty()) {
    set_bytes(*columns.mutable_multiplicity(), answer.multiplicity, first, count);
    set_bytes(*columns.mutable_stencil(), answer.stencil, first, count);
  }
}

void fill_distances(const Answer& answer, std::size_t first, std::size_t count, std::string& bytes) {
  set_bytes(bytes, answer.vertex_distances, first, count);
}

void fill_worlds(const Answer& answer, std::size_t first, std::size_t count, std::string& worlds,
                 std::string& tois) {
  set_bytes(worlds, answer.worlds, first, count);
  set_bytes(tois, answer.world_tois, first, count);
}

}  // namespace warmfront::server
