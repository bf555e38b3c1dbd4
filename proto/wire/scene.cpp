// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/scene.h"

#include <algorithm>
#include <array>

#include "proto/wire/enums.h"

namespace warmfront::wire {

v1::Body to_proto(const Body& body) {
  v1::Body message;
  message.set_name(body.name);
  message.set_first_vertex(body.first_vertex);
  message.set_vertex_count(body.vertex_count);
  message.set_kind(to_proto(body.kind));
  message.set_self_collision(body.self_collision);
  message.set_group(body.group);
  message.set_mask(body.mask);
  message.set_thickness(body.thickness);
  message.set_world(body.world);
  message.set_screw(body.screw);
  if (body.half_space) {
    for (const double x : body.half_space->point) message.mutable_half_space()->add_point(x);
    for (const double n : body.half_space->normal) message.mutable_half_space()->add_normal(n);
  }
  return message;
}

Result<Body> body_from(const v1::Body& message, const std::string& where) {
  // Checked before the scene is built, which may be minutes later.
  if (Status name = check_name(message.name(), where); !name) return name.error();
  Body body{message.name(), message.first_vertex(), message.vertex_count()};
  if (Status known = read(message.kind(), where + ".kind", body.kind); !known) return known.error();
  if (message.has_self_collision()) body.self_collision = message.self_collision();
  if (message.has_group()) body.group = message.group();
  if (message.has_mask()) body.mask = message.mask();
  body.thickness = message.thickness();
  body.world = message.world();
  body.screw = message.screw();
  if (message.has_half_space()) {
    HalfSpace& half_space = body.half_space.emplace();
    const auto read_three = [&](const auto& from, const char* name, std::array<double, 3>& to) -> Status {
      if (from.size() != 3)
        return invalid_argument(where + ".half_space." + name + ": has " + std::to_string(from.size()) +
                                " numbers; give 3");
      std::copy(from.begin(), from.end(), to.begin());
      return {};
    };
    if (Status read = read_three(message.half_space().point(), "point", half_space.point); !read)
      return read.error();
    if (Status read = read_three(message.half_space().normal(), "normal", half_space.normal); !read)
      return read.error();
  }
  return body;
}

std::vector<std::array<std::uint32_t, 2>> body_pairs_from(
    const google::protobuf::RepeatedPtrField<v1::BodyPair>& pairs) {
  std::vector<std::array<std::uint32_t, 2>> read;
  read.reserve(static_cast<std::size_t>(pairs.size()));
  for (const v1::BodyPair& pair : pairs) read.push_back({pair.a(), pair.b()});
  return read;
}

void set_body_pairs(google::protobuf::RepeatedPtrField<v1::BodyPair>& message,
                    std::span<const std::array<std::uint32_t, 2>> pairs) {
  message.Clear();
  for (const auto& [a, b] : pairs) {
    v1::BodyPair& pair = *message.Add();
    pair.set_a(a);
    pair.set_b(b);
  }
}

bool has_half_spaces(const v1::SessionHeader& header) {
  return std::ranges::any_of(header.bodies(), [](const v1::Body& body) { return body.has_half_space(); });
}

bool is_thick(const v1::SessionHeader& header) {
  return header.vertex_thickness() || std::ranges::any_of(header.bodies(), [](const v1::Body& body) {
           return body.kind() != v1::BODY_KIND_REMOVED && body.thickness() != 0;
         });
}

bool has_worlds(const v1::SessionHeader& header) {
  return std::ranges::any_of(header.bodies(), [](const v1::Body& body) {
    return body.kind() != v1::BODY_KIND_REMOVED && body.world() != 0;
  });
}

bool has_screws(const v1::SessionHeader& header) {
  return std::ranges::any_of(header.bodies(), [](const v1::Body& body) {
    return body.kind() != v1::BODY_KIND_REMOVED && body.screw();
  });
}

}  // namespace warmfront::wire
