// SPDX-License-Identifier: Apache-2.0
// An input's frames as states: see states.h.
#include "client/cli/states/states.h"

#include <CLI/CLI.hpp>
#include <utility>

#include "client/cli/exit_codes.h"
#include "client/cli/frames/frame_model.h"
#include "client/cli/progress.h"
#include "client/cli/verb.h"

namespace warmfront::client {

void add_state_arguments(CLI::App& app, StateArguments& arguments) {
  app.add_option("INPUT", arguments.inputs,
                 "A folder with mesh.ply and frames.pc2, or t0.ply, t1.ply, ..., and perhaps info.json; or "
                 "mesh files (.ply, .obj, .stl) of one topology; or a mesh file and its cache (.pc2, .mdd, .npy); or a "
                 ".npz with positions and faces; or builtin:NAME[?triangles=N&frames=N] "
                 "(see 'scene --list')")
      ->required();
  add_session_place(app, arguments.place);
  app.add_option("--bodies", arguments.bodies,
                 "The scene's model: as the input declares it (info.json), all deformable as one, or its "
                 "connected components")
      ->check(CLI::IsMember({"declared", "deformable", "components"}))
      ->capture_default_str();
  app.add_option("--frames", arguments.frames, "Only the frames from FIRST to LAST")->type_name("FIRST:LAST");
  add_filter_options(app, arguments.filters);
}

Status StateArguments::check() const {
  if (Status status = check_input_arguments(inputs, 1); !status) return status;
  if (const Result<BodiesMode> mode = parse_bodies_mode(bodies); !mode) return mode.error();
  return place.check();
}

std::optional<int> States::open(const StateArguments& arguments) {
  arguments_ = &arguments;
  Result<std::unique_ptr<Input>> opened = open_input(arguments.inputs, 1);
  if (!opened) return failure(opened.error().message);
  input_ = std::move(opened).value();
  print_notes(input_->notes());
  FrameRange range{0, input_->frame_count() - 1};
  if (!arguments.frames.empty()) {
    const Result<FrameRange> parsed = parse_frame_range(arguments.frames, input_->frame_count(), 1);
    if (!parsed) return usage_error(parsed.error().message);
    range = parsed.value();
  }
  Result<FrameSteps> steps = FrameSteps::open(*input_, range, 1);
  if (!steps) return failure(steps.error().message);
  steps_.emplace(std::move(steps).value());
  Result<SceneDescription> scene = with_bodies(input_->scene(), parse_bodies_mode(arguments.bodies).value());
  if (!scene) return failure(scene.error().message);
  scene_ = std::move(scene).value();
  if (Status status = take_filters(arguments.filters, *input_, scene_); !status)
    return failure(status.error().message);
  return std::nullopt;
}

int States::each(const std::function<Status(AnySession&)>& look) {
  Result<AnySession> session = open_session(arguments_->place, scene_, positions(), {});
  const auto failed = [&](const Error& error) {
    return failure(input_->name() + ": frame " + std::to_string(number()) + ": " + error.message);
  };
  if (!session && session.error().code == ErrorCode::kInvalidArgument) return failed(session.error());
  if (!session) return failure(session.error().message);
  Progress progress("frame", count());
  for (std::size_t frame = 0; frame < count(); ++frame) {
    if (frame > 0) {
      if (Status status = steps_->next(); !status) return failure(status.error().message);
      // A step, of which nothing is asked but to be there.
      const Result<Answer> moved =
          session.value().step(Frame(positions()), {.min_separation = 0.0, .report = Report::kCount});
      if (!moved) return failed(moved.error());
    }
    progress.clear();
    if (Status status = look(session.value()); !status) return failed(status.error());
    progress.update(frame + 1);
  }
  progress.clear();
  return kExitOk;
}

}  // namespace warmfront::client
