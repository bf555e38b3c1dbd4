// SPDX-License-Identifier: Apache-2.0
// A session's life, what interrupts it, and what it has: positions, poses and edges. Thread safety as stated
// in the interface's header.
#include "client/c/session.h"

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/c/errors.h"
#include "client/c/reading.h"
#include "client/c/structs.h"

using namespace warmfront;
using namespace warmfront::c;

namespace {

Status check_room(std::size_t room, std::size_t needed) {
  if (room >= needed) return {};
  return invalid_argument("count: " + std::to_string(room) + " numbers have room, and " +
                          std::to_string(needed) + " are needed");
}

}  // namespace

const char* wf_version(void) {
  return WARMFRONT_VERSION;
}

wf_code wf_create(const wf_scene* scene, const wf_options* options, wf_session** session) {
  if (session == nullptr) return fail(WF_INVALID_ARGUMENT, "session: is null; give where to put it");
  *session = nullptr;
  return guarded([&]() -> wf_code {
    if (scene == nullptr) return fail(WF_INVALID_ARGUMENT, "scene: is null");
    const Result<wf_scene> from = read(scene, wf_scene{}, "scene");
    if (!from) return fail(from.error());
    const Result<wf_options> chosen = read(options, initial_options(), "options");
    if (!chosen) return fail(chosen.error());
    const Result<ColliderOptions> taken = options_of(chosen.value());
    if (!taken) return fail(taken.error());
    const std::int32_t type = from.value().type;
    if (type != WF_FLOAT64 && type != WF_FLOAT32) return fail(out_of("type", type, WF_FLOAT32));
    const bool float32 = type == WF_FLOAT32;
    const Result<Positions> at =
        positions(from.value().positions, std::size_t{3} * from.value().vertex_count, float32, "positions");
    if (!at) return fail(at.error());
    Result<SceneDescription> description = scene_of(from.value(), at.value());
    if (!description) return fail(description.error());
    Result<Scene> made = Scene::create(std::move(description).value());
    if (!made) return fail(made.error());
    // All sessions share those of the process.
    static const auto* shared = new std::shared_ptr<Workers>(std::make_shared<Workers>(0));
    constexpr std::uint32_t kMostThreads = 1024;
    const std::uint32_t threads = chosen.value().threads;
    if (threads > kMostThreads) return fail(out_of("options.threads", threads, kMostThreads));
    Result<Collider> collider =
        Collider::create(std::make_shared<const Scene>(std::move(made).value()), at.value(), taken.value(),
                         threads == 0 ? *shared : std::make_shared<Workers>(static_cast<int>(threads)));
    if (!collider) return fail(collider.error());
    *session = new wf_session(std::move(collider).value(), float32, threads);
    return WF_OK;
  });
}
void wf_free(wf_session* session) {
  delete session;
}

wf_code wf_flag_create(wf_flag** flag) {
  if (flag == nullptr) return fail(WF_INVALID_ARGUMENT, "flag: is null; give where to put it");
  *flag = nullptr;
  return guarded([&]() -> wf_code {
    *flag = new wf_flag;
    return WF_OK;
  });
}
void wf_flag_set(wf_flag* flag, int32_t value) {
  if (flag != nullptr) flag->value.store(value != 0, std::memory_order_relaxed);
}
void wf_flag_free(wf_flag* flag) {
  delete flag;
}

wf_code wf_positions(const wf_session* session, double* to, size_t count) {
  return guarded([&]() -> wf_code {
    if (session == nullptr || to == nullptr)
      return fail(WF_INVALID_ARGUMENT, "session or positions: is null");
    const std::vector<double> at = session->local->collider().positions();
    if (Status room = check_room(count, at.size()); !room) return fail(room.error());
    std::ranges::copy(at, to);
    return WF_OK;
  });
}
wf_code wf_poses(const wf_session* session, double* to, size_t count) {
  return guarded([&]() -> wf_code {
    if (session == nullptr || (to == nullptr && count > 0))
      return fail(WF_INVALID_ARGUMENT, "session or poses: is null");
    const Collider& collider = session->local->collider();
    std::vector<BodyPose> poses(collider.scene().bodies().size());
    for (const BodyPose& pose : collider.poses()) poses[pose.body] = pose;
    constexpr std::size_t kNumbers = std::tuple_size_v<decltype(Pose::matrix)>;
    if (Status room = check_room(count, kNumbers * poses.size()); !room) return fail(room.error());
    for (const BodyPose& pose : poses) to = std::ranges::copy(pose.pose.matrix, to).out;
    return WF_OK;
  });
}
wf_code wf_edges(const wf_session* session, const uint32_t** edges, size_t* edge_count) {
  if (session == nullptr || edges == nullptr || edge_count == nullptr)
    return fail(WF_INVALID_ARGUMENT, "session, edges or edge_count: is null");
  const std::span<const Edge> all = session->local->collider().scene().edges();
  *edges = column<std::uint32_t>(all);
  *edge_count = all.size();
  return WF_OK;
}
