// SPDX-License-Identifier: Apache-2.0
// Putting an upload together. Thread safety as stated in the header.
#include "server/transport/upload.h"

#include <cstring>
#include <string>
#include <utility>

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
    return invalid("CreateSession: a message carries none of header, faces and positions");
  if (!spec_) return invalid("CreateSession: the header comes first, then faces and positions");
  if (request.part_case() == Request::kFaces) return add_faces(request.faces());
  if (Status added = positions_->append(request.positions()); !added) return fault_from(added.error());
  return std::nullopt;
}

std::optional<Fault> Upload::add_header(const v1::SessionHeader& header) {
  if (spec_) return invalid("CreateSession: a second header; one upload makes one session");
  Outcome<SessionSpec> spec = spec_from(header, limits_);
  if (!spec) return spec.fault();
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

std::size_t Upload::estimate_bytes() const {
  return server::estimate_bytes(spec_->scene.vertex_count, face_count_, size_of(spec_->dtype),
                                spec_->options.explain, limits_);
}

std::optional<Fault> Upload::complete() const {
  if (!spec_) return invalid("CreateSession: the upload ended before its header");
  if (face_bytes_ != expected_face_bytes())
    return invalid("faces: the upload ended after " + std::to_string(face_bytes_) + " of " +
                   std::to_string(expected_face_bytes()) + " bytes");
  if (Status complete = positions_->complete(); !complete)
    return fault_from(complete.error(), "the upload ended early: ");
  return std::nullopt;
}

}  // namespace warmfront::server
