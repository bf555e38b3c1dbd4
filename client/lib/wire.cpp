// SPDX-License-Identifier: Apache-2.0
// Messages to values and back. Thread-safe.
#include "client/lib/wire.h"

#include <array>
#include <bit>
#include <cstring>
#include <string_view>
#include <utility>

#include "proto/wire/codes.h"
#include "proto/wire/shared_columns.h"

namespace warmfront::client {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian and bytes are copied as they are");

Error malformed(std::string what) {
  return {ErrorCode::kInternal, "the daemon's answer is malformed: " + std::move(what)};
}

template <class T>
void append(std::string_view bytes, std::vector<T>& column) {
  const std::size_t rows = column.size();
  column.resize(rows + bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(column.data() + rows, bytes.data(), bytes.size());
}

}  // namespace

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
  info.lone_edge_count = message.lone_edge_count();
  info.body_count = message.body_count();
  info.float32 = message.dtype() == v1::DTYPE_FLOAT32;
  // An option unknown to this client is shown as the default.
  if (const auto options = wire::options_from(message.options()); options) info.options = options.value();
  info.last_frame = message.last_frame();
  info.steps = message.steps();
  info.memory_bytes = message.memory_bytes();
  const v1::PairFiltersHeader& filters = message.filters();
  info.filters = {filters.within_edges(), filters.near_at_rest(), filters.excluded_vertex_pair_count(),
                  filters.patches()};
  info.most_thickness = message.most_thickness();
  info.world_count = message.world_count();
  info.screw_count = message.screw_count();
  info.attached = message.attached();
  info.created = std::chrono::system_clock::time_point(std::chrono::milliseconds(message.created_unix_ms()));
  info.idle = std::chrono::milliseconds(message.idle_ms());
  return info;
}

namespace {

/// The columns of contacts, wherever they are.
struct ColumnBytes {
  explicit ColumnBytes(const v1::ContactColumns& message)
      : kind(message.kind()),
        status(message.status()),
        v(message.v()),
        toi(message.toi()),
        weights(message.weights()),
        normal(message.normal()),
        points(message.points()),
        squared_distance(message.squared_distance()),
        closest(message.closest()),
        direction(message.direction()),
        multiplicity(message.multiplicity()),
        stencil(message.stencil()) {}
  ColumnBytes() = default;

  std::string_view kind, status, v, toi, weights, normal, points, squared_distance, closest, direction,
      multiplicity, stencil;
};

/// All that an answer lists.
struct AnswerBytes {
  ColumnBytes contacts;
  std::string_view vertex_distances, worlds, world_tois;
};

/// Appends the rows. kInternal when the columns' lengths differ, or a value is not in its enum.
Status append_columns(const ColumnBytes& message, ContactTable& contacts) {
  const std::size_t rows = message.kind.size();
  const bool edge_faces = rows > 0 && message.kind[0] == 2;
  const std::size_t vertices = edge_faces ? 20 : 16;
  if (message.status.size() != rows || message.v.size() != vertices * rows || message.toi.size() != 8 * rows)
    return malformed("columns of unequal length");
  const auto fits = [rows](std::string_view column, std::size_t size) {
    return column.empty() || column.size() == size * rows;
  };
  if (!fits(message.weights, 32) || !fits(message.normal, 24) || !fits(message.points, 48) ||
      !fits(message.direction, 24) || !fits(message.squared_distance, 8) || !fits(message.closest, 1) ||
      !fits(message.multiplicity, 4) || !fits(message.stencil, 1) ||
      message.multiplicity.empty() != message.stencil.empty())
    return malformed("columns of unequal length");
  for (const char stencil : message.stencil)
    if (stencil < 0 || stencil > 15 || (stencil != 1 && std::popcount(static_cast<unsigned>(stencil)) < 2))
      return malformed("a stencil of no closest pair");
  for (const char closest : message.closest)
    if (closest < 0 || closest > 3) return malformed("closest features of unknown kind");
  for (const char kind : message.kind)
    if ((kind == 2) != edge_faces || kind < 0 || kind > 5) return malformed("a contact of unknown kind");
  for (const char status : message.status)
    if (status < 1 || status > 4) return malformed("a contact of unknown status");
  append(message.kind, contacts.kind);
  append(message.status, contacts.status);
  edge_faces ? append(message.v, contacts.edge_faces) : append(message.v, contacts.vertices);
  append(message.toi, contacts.toi);
  append(message.weights, contacts.weights);
  append(message.normal, contacts.normal);
  append(message.points, contacts.points);
  append(message.direction, contacts.direction);
  append(message.squared_distance, contacts.squared_distance);
  append(message.closest, contacts.closest);
  append(message.multiplicity, contacts.multiplicity);
  append(message.stencil, contacts.stencil);
  return {};
}

Status append_bytes(const AnswerBytes& bytes, Answer& answer) {
  if (bytes.vertex_distances.size() % sizeof(double) != 0)
    return malformed("distances of " + std::to_string(bytes.vertex_distances.size()) + " bytes");
  append(bytes.vertex_distances, answer.vertex_distances);
  if (bytes.worlds.size() % sizeof(std::uint32_t) != 0 || bytes.world_tois.size() != 2 * bytes.worlds.size())
    return malformed("worlds of " + std::to_string(bytes.worlds.size()) + " bytes, and their times of " +
                     std::to_string(bytes.world_tois.size()));
  append(bytes.worlds, answer.worlds);
  append(bytes.world_tois, answer.world_tois);
  return append_columns(bytes.contacts, answer.contacts);
}

/// Where they are in the room; none where they are beyond it.
std::optional<AnswerBytes> bytes_in(const SharedRegion::Block& room, const v1::StepAnswer& message) {
  const v1::StepSummary& summary = message.summary();
  const std::uint64_t rows = summary.rows();
  struct Place {
    wire::SharedColumn which;
    std::string_view* bytes;
    std::uint64_t count;
    std::uint64_t size;
  };
  AnswerBytes all;
  ColumnBytes& contacts = all.contacts;
  using enum wire::SharedColumn;
  const std::array<Place, 15> places{{{kKind, &contacts.kind, rows, 1},
                                      {kStatus, &contacts.status, rows, 1},
                                      {kVertices, &contacts.v, rows, summary.ef() > 0 ? 20U : 16U},
                                      {kToi, &contacts.toi, rows, 8},
                                      {kWeights, &contacts.weights, rows, 32},
                                      {kNormal, &contacts.normal, rows, 24},
                                      {kPoints, &contacts.points, rows, 48},
                                      {kSquaredDistance, &contacts.squared_distance, rows, 8},
                                      {kClosest, &contacts.closest, rows, 1},
                                      {kDirection, &contacts.direction, rows, 24},
                                      {kMultiplicity, &contacts.multiplicity, rows, 4},
                                      {kStencil, &contacts.stencil, rows, 1},
                                      {kVertexDistances, &all.vertex_distances, summary.distances(), 8},
                                      {kWorlds, &all.worlds, summary.worlds(), 4},
                                      {kWorldTois, &all.world_tois, summary.worlds(), 8}}};
  const std::uint64_t begin = room.offset;
  const std::uint64_t end = begin + room.size;
  std::uint64_t at = message.shared().offset();
  if (at < begin || at > end) return std::nullopt;
  for (const Place& place : places) {
    if ((message.shared().columns() & wire::bit_of(place.which)) == 0) continue;
    at = wire::column_begins(at);
    if (at > end || place.count > (end - at) / place.size) return std::nullopt;
    *place.bytes = {room.data.get() + (at - begin), static_cast<std::size_t>(place.count * place.size)};
    at += place.count * place.size;
  }
  return all;
}

}  // namespace

Status append_columns(const v1::ContactColumns& message, ContactTable& contacts) {
  return append_columns(ColumnBytes(message), contacts);
}

Status append_part(const v1::StepAnswer& message, Answer& answer,
                   const std::optional<SharedRegion::Block>& room) {
  if (!message.has_shared())
    return append_bytes(
        {ColumnBytes(message.contacts()), message.vertex_distances(), message.worlds(), message.world_tois()},
        answer);
  const std::optional<AnswerBytes> bytes = room ? bytes_in(*room, message) : std::nullopt;
  if (!bytes) return malformed("its columns are not within the room that it was given");
  return append_bytes(*bytes, answer);
}

Status finish_answer(const v1::StepAnswer& message, Answer& answer) {
  const v1::StepSummary& summary = message.summary();
  if (summary.distances() != answer.vertex_distances.size())
    return malformed(std::to_string(answer.vertex_distances.size()) + " of " +
                     std::to_string(summary.distances()) + " distances");
  if (summary.worlds() != answer.worlds.size())
    return malformed(std::to_string(answer.worlds.size()) + " of " + std::to_string(summary.worlds()) +
                     " worlds");
  if (summary.rows() != answer.contacts.size())
    return malformed(std::to_string(answer.contacts.size()) + " of " + std::to_string(summary.rows()) +
                     " contacts");
  answer.frame = message.frame();
  answer.vf = summary.vf();
  answer.ee = summary.ee();
  answer.ve = summary.ve();
  answer.vv = summary.vv();
  answer.ef = summary.ef();
  answer.vh = summary.vh();
  answer.possible = summary.possible();
  if (summary.has_earliest_toi()) answer.earliest_toi = summary.earliest_toi();
  answer.statistics = wire::statistics_from(summary.statistics());
  if (summary.has_all_deformable()) {
    const v1::AllDeformable& all = summary.all_deformable();
    answer.all_deformable.emplace(
        AllDeformable{wire::statistics_from(all.statistics()), all.frame_bytes(), all.positions_bytes()});
  }
  answer.overlaps_at_start = summary.overlaps_at_start();
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
  // gRPC's own codes: an interrupted connection shows as any of these, and a stream that the daemon's gRPC
  // reset for want of transport memory as RESOURCE_EXHAUSTED (ENHANCE_YOUR_CALM).
  if (error.code == ErrorCode::kResourceExhausted) return error.message.starts_with("Received RST_STREAM");
  return error.code == ErrorCode::kUnavailable || error.code == ErrorCode::kCancelled ||
         error.code == ErrorCode::kInternal || error.code == ErrorCode::kDeadlineExceeded;
}

bool same_state(const v1::SessionState& a, const v1::SessionState& b) {
  return a.frame() == b.frame() && a.revision() == b.revision() && a.digest() == b.digest();
}

RemoteError remote_error_from(const v1::Status& status) {
  RemoteError remote{{wire::error_code(status.code()), status.message()}};
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
  return {{wire::error_code(status.error_code()), status.error_message()}};
}

Result<v1::ColliderOptions> session_options(const ColliderOptions& options) {
  const auto of_question = [](const char* name) {
    return invalid_argument(std::string(name) + ": a daemon's session has none; give it with the question");
  };
  if (options.leave_out_overlaps) return of_question("leave_out_overlaps");
  if (options.reduced) return of_question("reduced");
  if (options.keep_distance) return of_question("keep_distance");
  if (options.pair_test != PairTest::kMotion) return of_question("pair_test");
  if (options.instant != Instant::kStart) return of_question("instant");
  return to_proto(options);
}

}  // namespace warmfront::client
