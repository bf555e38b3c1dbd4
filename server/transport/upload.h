// SPDX-License-Identifier: Apache-2.0
// A scene as it is uploaded: one header, then chunks, put together and checked. Used by one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "proto/wire/chunked_array.h"
#include "proto/wire/filters.h"
#include "server/session/limits.h"
#include "server/session/position_buffer.h"
#include "server/session/session.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::server {

class Upload {
 public:
  explicit Upload(const Limits& limits) : limits_(limits) {}

  /// Takes the next message. INVALID_ARGUMENT for a bad header, a chunk before it, a second one, or bytes
  /// beyond what it announced; RESOURCE_EXHAUSTED beyond the limits. Memory grows with what arrives, never
  /// with what was announced.
  std::optional<Fault> add(const v1::CreateSessionRequest& request);
  /// INVALID_ARGUMENT unless everything announced is there.
  std::optional<Fault> complete() const;

  /// Faces, edges and vertices that can be of none of them, as announced: a session's hierarchies hold as
  /// many or more. After the header only.
  std::uint64_t element_count() const;
  /// What the session is going to hold; after the header only.
  std::size_t estimate_bytes() const;
  /// Null before the header.
  const SessionId* id() const { return spec_ ? &spec_->id : nullptr; }
  /// Once complete; leaves the upload empty.
  /// Leaves the id, by which a session that cannot be made is named.
  SessionSpec take_spec() {
    SessionSpec spec = *std::move(spec_);
    spec.scene.filters = filters_.take();
    spec.scene.thickness = thickness_.take();
    spec.scene.edges = edges_.take();
    spec_->id = spec.id;
    return spec;
  }
  PositionBuffer take_positions() { return *std::move(positions_); }

 private:
  std::optional<Fault> add_header(const v1::SessionHeader& header);
  std::optional<Fault> add_faces(std::string_view bytes);
  FilterSize filter_size() const;
  std::size_t expected_face_bytes() const { return std::size_t{12} * face_count_; }

  const Limits& limits_;
  std::optional<SessionSpec> spec_;
  std::optional<PositionBuffer> positions_;
  wire::FiltersUpload filters_;
  wire::ChunkedArray<double> thickness_{"thickness"};
  wire::ChunkedArray<std::array<std::int32_t, 2>> edges_{"edges"};
  bool thick_ = false;
  std::uint32_t face_count_ = 0;
  std::uint32_t edge_count_ = 0;
  std::size_t face_bytes_ = 0;
};

}  // namespace warmfront::server
