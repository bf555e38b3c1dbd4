// SPDX-License-Identifier: Apache-2.0
// What `detect` does once its arguments and its input are known: steps through the input, part by part, and
// reports. Used by the main thread only.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "client/cli/detect/arguments.h"
#include "client/cli/detect/explain.h"
#include "client/cli/detect/outputs.h"
#include "client/cli/detect/report_json.h"
#include "client/cli/detect/stepper.h"
#include "client/cli/frames/frame_model.h"
#include "client/cli/frames/frame_steps.h"
#include "client/cli/progress.h"
#include "engine/contact_hash.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

class DetectRun {
 public:
  /// Of these frames in all parts of the input. `arguments` and `input` outlive this.
  DetectRun(const DetectArguments& arguments, Input& input, FrameRange range);

  /// Steps through a part. The first one makes the session; each that follows changes the session's scene, or
  /// makes another session where the scenes have too little in common (replaced_bodies.h).
  Status part(const PartRange& part);
  /// Writes and prints what was found.
  Status finish();

 private:
  Status begin(const PartRange& part, FrameSteps& steps, const SceneDescription& before);
  Status open_stepper(const Positions& first);
  Status begin_first(const PartRange& part, FrameSteps& steps, const Positions& first);
  Result<std::vector<ContactRecord>> enter(const PartRange& part, const Positions& first,
                                           const Positions& reference);
  Status start_recording(const Positions& first, const Positions& reference);
  Status start_report(const Positions& first);
  Result<SceneDescription> scene_of(Input& part) const;
  Status step_through(FrameSteps& steps);

  const DetectArguments& arguments_;
  Input& input_;
  const FrameRange range_;
  const bool table_;
  Progress progress_;
  SceneDescription scene_;
  std::unique_ptr<Stepper> stepper_;
  std::optional<FrameModel> frames_;
  std::optional<Explanation> explanation_;
  std::optional<DetectOutputs> outputs_;
  DetectReport report_;
  ContactHash hash_;
  std::optional<ContactHashPart> hash_part_;  // of a range that does not begin with the input, for its report
  std::vector<double> wide_;  // with substeps, a frame in double
};

}  // namespace warmfront::client
