// SPDX-License-Identifier: Apache-2.0
// Frames in memory, and their answers. Thread safety as stated in the header.
#include "client/cli/load/playback.h"

#include <utility>

#include "client/cli/progress.h"
#include "client/lib/any_session.h"

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

Result<ExpectedAnswers> ExpectedAnswers::compute(const Playback& playback, const ColliderOptions& options,
                                                 const Mix& mix, double distance) {
  Result<AnySession> created = AnySession::create(playback.scene(), playback.at(0), options);
  if (!created) return created.error();
  AnySession session = std::move(created).value();
  const std::uint64_t period = playback.period();
  ExpectedAnswers expected;
  Progress progress("expected answer", period);
  for (std::uint64_t tick = 0; tick < period; ++tick) {
    const auto keep = [tick](const Result<Answer>& answer, std::vector<AnswerDigest>& digests) -> Status {
      if (!answer)
        return Error{answer.error().code,
                     "in this process, tick " + std::to_string(tick) + ": " + answer.error().message};
      digests.push_back(digest_of(answer.value()));
      return {};
    };
    Status kept;
    if (mix.has(Asked::kProximity)) kept = keep(session.proximity(distance), expected.near_);
    if (kept && mix.has(Asked::kIntersections)) kept = keep(session.intersections(), expected.tangles_);
    if (kept && mix.has(Asked::kMaxStep)) {
      Result<MaxStep> far = session.max_step(Frame(playback.at(tick + 1)));
      kept = keep(far ? Result<Answer>(std::move(far.value().answer)) : Result<Answer>(far.error()),
                  expected.limits_);
    }
    if (kept) kept = keep(session.step(Frame(playback.at(tick + 1))), expected.motions_);
    if (!kept) return kept.error();
    progress.update(tick + 1);
  }
  return expected;
}

}  // namespace warmfront::client::load
