// SPDX-License-Identifier: Apache-2.0
// The fields of a frame that carries only what moved, as bytes. A plain value; used by one thread at a time.
#pragma once

#include <array>
#include <cstring>
#include <string>
#include <string_view>

#include "server/session/frame_buffer.h"

namespace warmfront::fuzz {

struct MovedParts {
  std::string bodies, body_positions, pose_bodies, poses, vertices, vertex_positions;

  std::array<std::string*, 6> fields() {
    return {&bodies, &body_positions, &pose_bodies, &poses, &vertices, &vertex_positions};
  }

  template <class T>
  static void put(std::string& field, T value) {
    field.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }

  /// In pieces of up to so many bytes of each field.
  void append_to(server::FrameBuffer& contents, std::size_t piece) const {
    std::size_t at = 0;
    bool more = true;
    while (more) {
      more = false;
      const auto next = [&](const std::string& field) {
        more = more || field.size() > at + piece;
        return at < field.size() ? std::string_view(field).substr(at, piece) : std::string_view();
      };
      static_cast<void>(
          contents.append(server::MovedPiece{next(bodies), next(body_positions), next(pose_bodies),
                                             next(poses), next(vertices), next(vertex_positions)}));
      at += piece;
    }
  }

  /// Whether a vertex is named that the scene does not have, or a body that may not be moved.
  bool names_nobody(const Scene& scene) const {
    for (std::size_t at = 0; at + 4 <= vertices.size(); at += 4)
      if (number(vertices, at) >= scene.vertex_count()) return true;
    for (const std::string* field : {&bodies, &pose_bodies})
      for (std::size_t at = 0; at + 4 <= field->size(); at += 4)
        if (const std::uint32_t body = number(*field, at);
            body >= scene.body_count() || scene.bodies()[body].kind >= BodyKind::kStatic)
          return true;
    return false;
  }

 private:
  static std::uint32_t number(const std::string& field, std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, field.data() + at, sizeof(value));
    return value;
  }
};

}  // namespace warmfront::fuzz
