// SPDX-License-Identifier: Apache-2.0
// Positions of recorded frames. Thread safety as stated in the header.
#include "client/cli/recording/recorded_input.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "client/cli/recording/from_wire.h"
#include "client/cli/recording/recorded_session.h"

namespace warmfront::client {
namespace {

class RecordedInput final : public Input {
 public:
  RecordedInput(std::string name, SceneDescription scene, std::vector<PositionBuffer> frames,
                std::vector<std::string> notes)
      : Input(std::move(name), std::move(scene), static_cast<std::uint32_t>(frames.size()), std::move(notes)),
        frames_(std::move(frames)) {}

  Status read_frame(std::uint32_t index, PositionBuffer& positions) override {
    if (index >= frame_count()) return invalid_argument(name() + ": no frame " + std::to_string(index));
    positions = frames_[index];
    return {};
  }

 private:
  std::vector<PositionBuffer> frames_;
};

/// All current positions, and the reference shapes of poses.
struct Placement {
  PositionBuffer placed;
  PositionBuffer rest;

  template <class Real>
  void put(std::size_t first, std::span<const Real> rows) {
    for (PositionBuffer* buffer : {&placed, &rest})
      std::ranges::copy(rows,
                        std::get<std::vector<Real>>(*buffer).begin() + static_cast<std::ptrdiff_t>(first));
  }
  void put(std::size_t first_vertex, const Positions& positions) {
    std::visit([&](auto rows) { put(3 * first_vertex, rows); }, positions);
  }

  /// False for poses whose positions float32 cannot represent.
  bool take(const Frame& frame, const Scene& scene) {
    if (frame.positions) put(0, *frame.positions);
    for (const BodyPositions& body : frame.bodies)
      put(scene.bodies()[body.body].first_vertex, body.positions);
    for (const BodyPose& pose : frame.poses)
      if (!take(pose, scene)) return false;
    for (std::size_t i = 0; i < frame.vertices.size(); ++i)
      std::visit([&](auto rows) { put(std::size_t{3} * frame.vertices[i], rows.subspan(3 * i, 3)); },
                 frame.vertex_positions);
    return true;
  }

  bool take(const BodyPose& pose, const Scene& scene) {
    auto* doubles = std::get_if<std::vector<double>>(&placed);
    if (doubles == nullptr) return false;
    const Body& body = scene.bodies()[pose.body];
    for (std::size_t v = body.first_vertex; v < std::size_t{body.first_vertex} + body.vertex_count; ++v)
      std::ranges::copy(pose.pose.place(std::get<std::vector<double>>(rest).data() + 3 * v),
                        doubles->begin() + static_cast<std::ptrdiff_t>(3 * v));
    return true;
  }
};

}  // namespace

bool is_recording_name(const std::string& name) {
  return name.ends_with(".wfrec");
}

Result<RecordedScene> open_recorded_scene(const std::string& path) {
  Result<RecordedSession> opened = RecordedSession::open(path);
  if (!opened) return opened.error();
  RecordedSession& recorded = opened.value();
  const Result<Scene> scene = Scene::create(recorded.scene());
  if (!scene) return invalid_argument(path + ": " + scene.error().message);
  const auto unfit = [&path](const std::string& why) {
    return invalid_argument(path + ": " + why +
                            ": 'replay' can do it, but it is no sequence of whole frames");
  };
  Placement placement{recorded.positions(), recorded.positions()};
  for (const BodyPose& pose : recorded.poses()) {
    if (pose.body >= scene.value().bodies().size())
      return invalid_argument(path + ": the upload: there is no body " + std::to_string(pose.body));
    if (!placement.take(pose, scene.value())) return unfit("it begins with poses in float32");
  }
  std::vector<PositionBuffer> frames{placement.placed};
  for (;;) {
    auto event = recorded.next();
    if (!event) return event.error();
    if (!event.value()) break;
    const auto* step = std::get_if<RecordedStep>(&*event.value());
    if (step == nullptr) return unfit("its scene changes");
    // Refused frames were not counted, and repeated ones are already present.
    const bool answered = step->answer && step->answer->outcome().code() == 0;
    if (answered && step->commit) return unfit("frames are made of parts of trials");
    if (!answered || !step->counts() || step->frame != recorded.session().first_frame() + frames.size())
      continue;
    if (step->places()) return unfit("frame " + std::to_string(step->frame) + " is no motion: it is placed");
    const Result<WireFrame> frame = WireFrame::read(step->parts, recorded.float32(), scene.value());
    if (!frame)
      return invalid_argument(path + ": frame " + std::to_string(step->frame) + ": " + frame.error().message);
    const Frame parts = frame.value().frame();
    const std::uint32_t vertices = scene.value().vertex_count();
    const std::size_t bodies = scene.value().bodies().size();
    if (std::ranges::any_of(parts.vertices, [&](std::uint32_t v) { return v >= vertices; }) ||
        std::ranges::any_of(parts.poses, [&](const BodyPose& p) { return p.body >= bodies; }))
      return invalid_argument(path + ": frame " + std::to_string(step->frame) +
                              " names what the scene has not");
    if (!placement.take(parts, scene.value()))
      return unfit("frame " + std::to_string(step->frame) + " has poses in float32");
    frames.push_back(placement.placed);
  }
  if (frames.size() < 2) return invalid_argument(path + ": no frame of it was answered");
  std::vector<std::string> notes;
  if (const std::string defect = recorded.defect(); !defect.empty())
    notes.push_back(path + ": the recording is incomplete: " + defect);
  return RecordedScene{
      std::make_unique<RecordedInput>(path, recorded.scene(), std::move(frames), std::move(notes)),
      recorded.options()};
}

}  // namespace warmfront::client
