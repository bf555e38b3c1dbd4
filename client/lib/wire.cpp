// SPDX-License-Identifier: Apache-2.0
// Messages to values and back. Thread-safe.
#include "client/lib/wire.h"

#include <bit>
#include <cstring>
#include <utility>

namespace warmfront::client {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian and bytes are copied as they are");

Error malformed(std::string what) {
  return {ErrorCode::kInternal, "the daemon's answer is malformed: " + std::move(what)};
}

template <class T>
void append(const std::string& bytes, std::vector<T>& column) {
  const std::size_t rows = column.size();
  column.resize(rows + bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(column.data() + rows, bytes.data(), bytes.size());
}

FrontState front_state_from(v1::FrontState state) {
  switch (state) {
    case v1::FRONT_STATE_BUILT:
      return FrontState::kBuilt;
    case v1::FRONT_STATE_UPDATED:
      return FrontState::kUpdated;
    case v1::FRONT_STATE_REBUILT:
      return FrontState::kRebuilt;
    case v1::FRONT_STATE_CAPPED:
      return FrontState::kCapped;
    default:
      return FrontState::kNone;
  }
}

BoundsKind bounds_from(v1::BoundsKind kind) {
  if (kind == v1::BOUNDS_KIND_AABB) return BoundsKind::kAabb;
  return kind == v1::BOUNDS_KIND_KDOP18 ? BoundsKind::kKDop18 : BoundsKind::kAuto;
}

StepStatistics statistics_from(const v1::StepStatistics& message) {
  StepStatistics statistics;
  const v1::StageTimes& ms = message.ms();
  statistics.ms = {ms.total(), ms.refit(), ms.front(), ms.elementary(), ms.adjacent()};
  const v1::StepCounts& from = message.counts();
  StepCounts& to = statistics.counts;
  to.bv_tests = from.bv_tests();
  to.front_pairs = from.front_pairs();
  to.front_bytes = from.front_bytes();
  to.front_skipped = from.front_skipped();
  to.front_sprouted = from.front_sprouted();
  to.front_pruned = from.front_pruned();
  to.triangle_pairs = from.triangle_pairs();
  to.adjacent_pairs = from.adjacent_pairs();
  to.cone_culled_pairs = from.cone_culled_pairs();
  to.cone_patches = from.cone_patches();
  to.elementary_tests = from.elementary_tests();
  to.orphan_tests = from.orphan_tests();
  to.coplanarity_passed = from.coplanarity_passed();
  to.exact_tests = from.exact_tests();
  to.primitive_tests = from.primitive_tests();
  to.front_rested = from.front_rested();
  to.contacts_kept = from.contacts_kept();
  to.vertices_moved = from.vertices_moved();
  to.nodes_refit = from.nodes_refit();
  to.parts_moved = from.parts_moved();
  to.near_parts = from.near_parts();
  to.parts_apart = from.parts_apart();
  to.part_pairs_excluded = from.part_pairs_excluded();
  to.parts = from.parts();
  to.parts_rigid = from.parts_rigid();
  statistics.front_state = front_state_from(message.front_state());
  statistics.bounds = bounds_from(message.bounds());
  return statistics;
}

ErrorCode code_from(int code) {
  switch (code) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return ErrorCode::kInvalidArgument;
    case grpc::StatusCode::FAILED_PRECONDITION:
      return ErrorCode::kFailedPrecondition;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return ErrorCode::kResourceExhausted;
    case grpc::StatusCode::UNIMPLEMENTED:
      return ErrorCode::kUnimplemented;
    case grpc::StatusCode::CANCELLED:
      return ErrorCode::kCancelled;
    case grpc::StatusCode::DATA_LOSS:
      return ErrorCode::kDataLoss;
    case grpc::StatusCode::NOT_FOUND:
      return ErrorCode::kNotFound;
    case grpc::StatusCode::ALREADY_EXISTS:
      return ErrorCode::kAlreadyExists;
    case grpc::StatusCode::ABORTED:
      return ErrorCode::kAborted;
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return ErrorCode::kDeadlineExceeded;
    case grpc::StatusCode::UNAUTHENTICATED:
      return ErrorCode::kUnauthenticated;
    case grpc::StatusCode::PERMISSION_DENIED:
      return ErrorCode::kPermissionDenied;
    case grpc::StatusCode::UNAVAILABLE:
      return ErrorCode::kUnavailable;
    default:
      return ErrorCode::kInternal;
  }
}

}  // namespace

v1::ColliderOptions to_proto(const ColliderOptions& options) {
  v1::ColliderOptions message;
  // Both enums list the same names in the same order; the wire's begin with UNSPECIFIED.
  message.set_tier(static_cast<v1::Tier>(static_cast<int>(options.tier) + 1));
  message.set_report(static_cast<v1::Report>(static_cast<int>(options.report) + 1));
  message.set_front(static_cast<v1::FrontMode>(static_cast<int>(options.front) + 1));
  message.set_bounds(static_cast<v1::BoundsKind>(static_cast<int>(options.bounds) + 1));
  message.set_find_bodies(options.find_bodies);
  message.set_find_rigid(options.find_rigid);
  message.set_separate_parts(options.separate_parts);
  message.set_explain(options.explain);
  message.set_tolerance(options.tolerance);
  message.set_min_separation(options.min_separation);
  message.set_normal_cones(options.normal_cones);
  message.set_lazy_front(options.lazy_front);
  message.set_leaf_size(options.leaf_size);
  message.mutable_fields()->set_weights(options.fields.weights);
  message.mutable_fields()->set_normal(options.fields.normal);
  message.mutable_fields()->set_points(options.fields.points);
  message.set_rebuild_after_stalled_steps(options.rebuild_after_stalled_steps);
  message.set_rebuild_every_steps(options.rebuild_every_steps);
  message.set_max_front_bytes(options.max_front_bytes);
  message.set_max_contacts(options.max_contacts);
  return message;
}

ColliderOptions options_from(const v1::ColliderOptions& message) {
  ColliderOptions options;
  if (message.tier() == v1::TIER_FAST) options.tier = Tier::kFast;
  if (message.tier() == v1::TIER_EXACT) options.tier = Tier::kExact;
  if (message.report() == v1::REPORT_EARLIEST) options.report = Report::kEarliest;
  if (message.report() == v1::REPORT_COUNT) options.report = Report::kCount;
  if (message.front() == v1::FRONT_MODE_NONE) options.front = FrontMode::kNone;
  if (message.front() == v1::FRONT_MODE_PAPER) options.front = FrontMode::kPaper;
  options.bounds = bounds_from(message.bounds());
  options.find_bodies = message.find_bodies();
  options.find_rigid = message.find_rigid();
  options.separate_parts = message.separate_parts();
  options.explain = message.explain();
  options.tolerance = message.tolerance();
  options.min_separation = message.min_separation();
  options.normal_cones = message.normal_cones();
  options.lazy_front = message.lazy_front();
  options.leaf_size = message.leaf_size();
  options.rebuild_after_stalled_steps = message.rebuild_after_stalled_steps();
  options.rebuild_every_steps = message.rebuild_every_steps();
  options.max_front_bytes = message.max_front_bytes();
  options.max_contacts = message.max_contacts();
  options.fields = {message.fields().weights(), message.fields().normal(), message.fields().points()};
  return options;
}

v1::Body to_proto(const Body& body) {
  v1::Body message;
  message.set_name(body.name);
  message.set_first_vertex(body.first_vertex);
  message.set_vertex_count(body.vertex_count);
  message.set_kind(static_cast<v1::BodyKind>(static_cast<int>(body.kind) + 1));
  message.set_self_collision(body.self_collision);
  message.set_group(body.group);
  message.set_mask(body.mask);
  return message;
}

ServerInfo server_info_from(const v1::GetServerInfoResponse& message) {
  const v1::Limits& limits = message.limits();
  return {message.version(),
          {limits.window(), limits.max_message_bytes(), limits.answer_chunk_bytes(), limits.max_sessions(),
           limits.max_vertices(), limits.max_triangles(), limits.max_contacts()},
          message.threads(),
          message.sessions(),
          message.draining(),
          std::chrono::milliseconds(message.uptime_ms())};
}

SessionInfo session_info_from(const v1::SessionInfo& message) {
  SessionInfo info;
  info.id = message.session_id();
  info.vertex_count = message.vertex_count();
  info.face_count = message.face_count();
  info.edge_count = message.edge_count();
  info.body_count = message.body_count();
  info.float32 = message.dtype() == v1::DTYPE_FLOAT32;
  info.options = options_from(message.options());
  info.last_frame = message.last_frame();
  info.steps = message.steps();
  info.memory_bytes = message.memory_bytes();
  info.attached = message.attached();
  info.created = std::chrono::system_clock::time_point(std::chrono::milliseconds(message.created_unix_ms()));
  info.idle = std::chrono::milliseconds(message.idle_ms());
  return info;
}

Status append_columns(const v1::ContactColumns& message, ContactTable& contacts) {
  const std::size_t rows = message.kind().size();
  if (message.status().size() != rows || message.v().size() != 16 * rows || message.toi().size() != 8 * rows)
    return malformed("columns of unequal length");
  const auto fits = [rows](const std::string& column, std::size_t size) {
    return column.empty() || column.size() == size * rows;
  };
  if (!fits(message.weights(), 32) || !fits(message.normal(), 24) || !fits(message.points(), 48))
    return malformed("columns of unequal length");
  for (const char kind : message.kind())
    if (kind != 0 && kind != 1) return malformed("a contact of unknown kind");
  for (const char status : message.status())
    if (status < 1 || status > 4) return malformed("a contact of unknown status");
  append(message.kind(), contacts.kind);
  append(message.status(), contacts.status);
  append(message.v(), contacts.vertices);
  append(message.toi(), contacts.toi);
  append(message.weights(), contacts.weights);
  append(message.normal(), contacts.normal);
  append(message.points(), contacts.points);
  return {};
}

Status finish_answer(const v1::StepAnswer& message, Answer& answer) {
  const v1::StepSummary& summary = message.summary();
  if (summary.rows() != answer.contacts.size())
    return malformed(std::to_string(answer.contacts.size()) + " of " + std::to_string(summary.rows()) +
                     " contacts");
  answer.frame = message.frame();
  answer.vf = summary.vf();
  answer.ee = summary.ee();
  answer.possible = summary.possible();
  if (summary.has_earliest_toi()) answer.earliest_toi = summary.earliest_toi();
  answer.statistics = statistics_from(summary.statistics());
  if (summary.has_all_deformable()) {
    const v1::AllDeformable& all = summary.all_deformable();
    answer.all_deformable.emplace(
        AllDeformable{statistics_from(all.statistics()), all.frame_bytes(), all.positions_bytes()});
  }
  answer.travel.queue_ms = summary.queue_ms();
  return {};
}

bool RemoteError::lost_session() const {
  return reason == v1::ERROR_REASON_SESSION_NOT_FOUND || reason == v1::ERROR_REASON_DATA_LOSS;
}

bool RemoteError::other_state() const {
  return reason == v1::ERROR_REASON_FRAME_CHANGED || reason == v1::ERROR_REASON_STATE_CHANGED;
}

bool RemoteError::may_resume() const {
  if (lost_session() || other_state() || retry_after || reason == v1::ERROR_REASON_DRAINING) return true;
  if (reason != v1::ERROR_REASON_UNSPECIFIED) return false;
  // gRPC's own: a connection that ends in the middle shows as any of these.
  return error.code == ErrorCode::kUnavailable || error.code == ErrorCode::kCancelled ||
         error.code == ErrorCode::kInternal || error.code == ErrorCode::kDeadlineExceeded;
}

bool same_state(const v1::SessionState& a, const v1::SessionState& b) {
  return a.frame() == b.frame() && a.revision() == b.revision() && a.digest() == b.digest();
}

RemoteError remote_error_from(const v1::Status& status) {
  RemoteError remote{{code_from(status.code()), status.message()}};
  v1::ErrorDetail detail;
  for (const google::protobuf::Any& any : status.details()) {
    if (!any.UnpackTo(&detail)) continue;
    remote.reason = detail.reason();
    if (detail.has_retry_after_ms()) remote.retry_after = std::chrono::milliseconds(detail.retry_after_ms());
  }
  return remote;
}

RemoteError remote_error_from(const grpc::Status& status) {
  v1::Status message;
  if (!status.error_details().empty() && message.ParseFromString(status.error_details())) {
    message.set_code(status.error_code());
    message.set_message(status.error_message());
    return remote_error_from(message);
  }
  return {{code_from(status.error_code()), status.error_message()}};
}

}  // namespace warmfront::client
