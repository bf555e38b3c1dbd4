// SPDX-License-Identifier: Apache-2.0
// An edge and a face that meet: see tangle.h.
#include "client/cli/states/tangle.h"

#include <cinttypes>
#include <cstdio>
#include <memory>
#include <utility>

#include "client/cli/print.h"
#include "engine/collider.h"

namespace warmfront::client {

std::array<double, 3> place_of(const EdgeFace& pair, const Positions& at) {
  std::array<double, 3> middle{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    middle[axis] = coordinate(at, std::size_t{3} * pair[0] + axis) / 2 +
                   coordinate(at, std::size_t{3} * pair[1] + axis) / 2;
  return middle;
}

std::string describe(const EdgeFace& v, const Positions& at) {
  const auto [x, y, z] = place_of(v, at);
  return print("edge %" PRIu32 "-%" PRIu32 " meets face %" PRIu32 "-%" PRIu32 "-%" PRIu32
               " near (%.6g, %.6g, %.6g)",
               v[0], v[1], v[2], v[3], v[4], x, y, z);
}

Status warn_if_tangled(const SceneDescription& description, const Positions& positions,
                       std::uint64_t number) {
  Result<Scene> scene = Scene::create(description);
  if (!scene) return scene.error();
  Result<Collider> collider =
      Collider::create(std::make_shared<const Scene>(std::move(scene).value()), positions,
                       {.front = FrontMode::kNone}, std::make_shared<Workers>(0));
  if (!collider) return collider.error();
  constexpr std::size_t kMost = 100'000;  // a scene in one point has as many as pairs of features
  const Result<StepResult> meeting = collider.value().intersections(Where::kBase, {.max_contacts = kMost});
  if (!meeting && meeting.error().code == ErrorCode::kResourceExhausted) {
    std::fprintf(stderr,
                 "warmfront: frame %" PRIu64 " is tangled: more than %zu pairs of edges and faces meet\n",
                 number, kMost);
    return {};
  }
  if (!meeting) return meeting.error();
  if (meeting.value().ef == 0) return {};
  const EdgeFace first = collider.value().scene().edge_face_vertices_of(meeting.value().contacts.front());
  std::fprintf(stderr,
               "warmfront: frame %" PRIu64 " is tangled: %" PRIu64
               " pairs of edges and faces meet, the first: %s; 'warmfront tangled' lists them\n",
               number, meeting.value().ef, describe(first, positions).c_str());
  return {};
}

}  // namespace warmfront::client
