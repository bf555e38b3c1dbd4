// SPDX-License-Identifier: Apache-2.0
// Putting an upload together. Thread safety as stated in the header.
#include "server/transport/upload.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "proto/wire/scene.h"
#include "server/transport/convert.h"

namespace warmfront::server {
namespace {

Fault invalid(std::string message) {
  return {ErrorCode::kInvalidArgument, Reason::kInvalidInput, std::move(message)};
}

}  // namespace

std::optional<Fault> Upload::add(const v1::CreateSessionRequest& request) {
  using Request = v1::CreateSessionRequest;
  if (request.part_case() == Request::kHeader) return add_header(request.header());
  if (request.part_case() == Request::PART_NOT_SET)
    return invalid(
        "CreateSession: a message carries none of header, faces, edges, positions, thickness and filters' "
        "arrays");
  if (!spec_)
    return invalid(
        "CreateSession: the header comes first, then faces, edges, positions, thickness and filters' arrays");
  if (request.part_case() == Request::kFaces) return add_faces(request.faces());
  const Status added = request.part_case() == Request::kPositions   ? positions_->append(request.positions())
                       : request.part_case() == Request::kThickness ? thickness_.append(request.thickness())
                       : request.part_case() == Request::kEdges     ? edges_.append(request.edges())
                                                                    : filters_.add(request);
  if (!added) return fault_from(added.error());
  return std::nullopt;
}

std::optional<Fault> Upload::add_header(const v1::SessionHeader& header) {
  if (spec_) return invalid("CreateSession: a second header; one upload makes one session");
  Outcome<SessionSpec> spec = spec_from(header, limits_);
  if (!spec) return spec.fault();
  if (header.has_filters()) {
    Result<wire::FiltersUpload> filters =
        wire::FiltersUpload::announced(header.filters(), header.vertex_count());
    if (!filters) return fault_from(filters.error());
    filters_ = std::move(filters).value();
  }
  if (header.vertex_thickness()) thickness_ = wire::ChunkedArray<double>("thickness", header.vertex_count());
  edge_count_ = header.edge_count();
  if (edge_count_ > 0) edges_ = wire::ChunkedArray<std::array<std::int32_t, 2>>("edges", edge_count_);
  thick_ = wire::is_thick(header);
  spec_ = std::move(spec).value();
  face_count_ = header.face_count();
  positions_.emplace(spec_->dtype, header.vertex_count());
  return std::nullopt;
}

std::optional<Fault> Upload::add_faces(std::string_view bytes) {
  if (bytes.size() > expected_face_bytes() - face_bytes_)
    return invalid("faces: " + std::to_string(face_bytes_ + bytes.size()) + " bytes, but " +
                   std::to_string(expected_face_bytes()) + " are expected (" + std::to_string(face_count_) +
                   " faces x 3 x int32)");
  if (bytes.empty()) return std::nullopt;
  const std::size_t end = face_bytes_ + bytes.size();
  spec_->scene.faces.resize((end + 11) / 12);
  std::memcpy(reinterpret_cast<char*>(spec_->scene.faces.data()) + face_bytes_, bytes.data(), bytes.size());
  face_bytes_ = end;
  return std::nullopt;
}

std::uint64_t Upload::element_count() const {
  const std::uint64_t faces = face_count_, edges = edge_count_, vertices = spec_->scene.vertex_count;
  const std::uint64_t named = std::min(3 * faces + 2 * edges, vertices);
  return faces + edges + (vertices - named);
}

std::size_t Upload::estimate_bytes() const {
  const auto half_spaces = std::ranges::count_if(
      spec_->scene.bodies, [](const Body& body) { return body.half_space.has_value(); });
  const std::uint64_t vertices =
      spec_->scene.vertex_count + kVerticesPerHalfSpace * static_cast<std::uint64_t>(half_spaces);
  return server::estimate_bytes(vertices, element_count(), size_of(spec_->dtype), spec_->options.explain,
                                thick_, limits_) +
         estimate_filter_bytes(filter_size(), spec_->scene.vertex_count, spec_->options.explain);
}

FilterSize Upload::filter_size() const {
  const v1::PairFiltersHeader& announced = filters_.header();
  return {announced.within_edges(), announced.near_at_rest() > 0, announced.excluded_vertex_pair_count(),
          announced.patches()};
}

std::optional<Fault> Upload::complete() const {
  if (!spec_) return invalid("CreateSession: the upload ended before its header");
  if (face_bytes_ != expected_face_bytes())
    return invalid("faces: the upload ended after " + std::to_string(face_bytes_) + " of " +
                   std::to_string(expected_face_bytes()) + " bytes");
  if (Status complete = positions_->complete(); !complete)
    return fault_from(complete.error(), "the upload ended early: ");
  if (Status complete = edges_.complete(); !complete) return fault_from(complete.error());
  if (Status complete = thickness_.complete(); !complete) return fault_from(complete.error());
  if (Status complete = filters_.complete(); !complete) return fault_from(complete.error());
  return std::nullopt;
}

}  // namespace warmfront::server
