// SPDX-License-Identifier: Apache-2.0
// Bodies on the wire. Thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/result.h"
#include "engine/scene.h"
#include "proto/wire/chunked_array.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::wire {

/// Every field set.
v1::Body to_proto(const Body& body);
/// Omitted fields get their default. kInvalidArgument, with a message that begins with `where`, for a kind
/// unknown to this build, a name that is too long, or a half-space of other than 3 coordinates.
Result<Body> body_from(const v1::Body& message, const std::string& where);

std::vector<std::array<std::uint32_t, 2>> body_pairs_from(
    const google::protobuf::RepeatedPtrField<v1::BodyPair>& pairs);
void set_body_pairs(google::protobuf::RepeatedPtrField<v1::BodyPair>& message,
                    std::span<const std::array<std::uint32_t, 2>> pairs);

/// Calls `send` with each message of an upload that brings these, as upload() of filters.h does.
template <class Send>
bool upload_thickness(const std::vector<double>& thickness, std::size_t chunk, Send send) {
  return send_chunks(as_bytes(thickness), chunk, send, [](v1::CreateSessionRequest& to, std::string piece) {
    to.set_thickness(std::move(piece));
  });
}

/// Does it announce any half-space?
bool has_half_spaces(const v1::SessionHeader& header);
/// Does it announce any thickness, of vertices or of bodies?
bool is_thick(const v1::SessionHeader& header);
/// Is any body in a world of its own?
bool has_worlds(const v1::SessionHeader& header);
/// Does any body move along a screw?
bool has_screws(const v1::SessionHeader& header);

}  // namespace warmfront::wire
