// SPDX-License-Identifier: Apache-2.0
// Frames in memory, and their answers. Thread safety as stated in the header.
#include "client/cli/load/playback.h"

#include <utility>

#include "client/cli/progress.h"

namespace warmfront::client::load {

Result<Playback> Playback::read(Input& input, SceneDescription scene) {
  std::vector<PositionBuffer> frames(input.frame_count());
  for (std::uint32_t i = 0; i < input.frame_count(); ++i)
    if (Status read = input.read_frame(i, frames[i]); !read) return read.error();
  return Playback(std::move(scene), std::move(frames));
}

Positions Playback::at(std::uint64_t tick) const {
  const std::uint64_t at = tick % period();
  return view(frames_[at < frames_.size() ? at : period() - at]);
}

Result<ExpectedAnswers> ExpectedAnswers::compute(const Playback& playback, const ColliderOptions& options) {
  Result<std::unique_ptr<Stepper>> stepper = make_local_stepper(playback.scene(), playback.at(0), options, 0);
  if (!stepper) return stepper.error();
  std::vector<AnswerDigest> digests(playback.period());
  Progress progress("expected answer", playback.period());
  for (std::uint64_t tick = 1; tick <= playback.period(); ++tick) {
    const Result<StepAnswer> answer = stepper.value()->step(playback.at(tick));
    if (!answer)
      return Error{answer.error().code,
                   "in this process, tick " + std::to_string(tick) + ": " + answer.error().message};
    digests[tick % playback.period()] = digest_of(answer.value());
    progress.update(tick);
  }
  return ExpectedAnswers(std::move(digests));
}

}  // namespace warmfront::client::load
