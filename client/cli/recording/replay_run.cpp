// SPDX-License-Identifier: Apache-2.0
// The replay: see replay_run.h.
#include "client/cli/recording/replay_run.h"

#include <optional>
#include <utility>

#include "client/cli/recording/from_wire.h"
#include "proto/wire/codes.h"

namespace warmfront::client {
namespace {

AnswerDigest digest_of(const v1::RecordedAnswer& answer) {
  AnswerDigest digest{answer.vf(), answer.ee(), answer.possible(), std::nullopt, answer.contacts_hash(),
                      answer.vh()};
  if (answer.has_earliest_toi()) digest.earliest_toi = answer.earliest_toi();
  return digest;
}

std::string outcome_text(const v1::RecordedOutcome& outcome) {
  return "refused with code " + std::to_string(outcome.code()) + " (" + outcome.message() + ")";
}

class Replay {
 public:
  Replay(RecordedSession& recorded, ReplayTarget& target)
      : target_(target), expected_(recorded.session().first_frame() + 1) {}

  Status step(const RecordedStep& step) {
    // A recording that ends within a step may end with the frame that crashed the daemon.
    const int code = step.answer ? step.answer->outcome().code() : 0;
    if (code != 0 && code != wire::canonical_code(ErrorCode::kInvalidArgument)) {
      ++result_.left_out;
      return {};
    }
    if (code == 0 && step.counts() && step.frame + 1 == expected_ && last_)
      return compare(step, *last_);  // from memory
    if (step.frame != expected_) {
      if (code == 0)
        return invalid_argument("frame " + std::to_string(step.frame) +
                                " is answered in the recording where " + std::to_string(expected_) +
                                " is due");
      ++result_.left_out;
      return {};
    }
    const Result<AnswerDigest> answer = target_.step(step);
    if (!answer && answer.error().code != ErrorCode::kInvalidArgument)
      return Error{answer.error().code,
                   "frame " + std::to_string(step.frame) + ": " + answer.error().message};
    ++(step.places() ? result_.placements : result_.steps);
    if (!step.answer) return {};
    if (!answer || code != 0) return compare_refusal(step, answer);
    if (step.counts()) {
      ++expected_;
      last_ = answer.value();
    }
    return compare(step, answer.value());
  }

  Status change(const RecordedChange& change) {
    const int code = change.outcome ? change.outcome->code() : 0;
    if (code != 0 && code != wire::canonical_code(ErrorCode::kInvalidArgument)) {
      ++result_.left_out;
      return {};
    }
    const Status changed = target_.change(change.request);
    ++result_.changes;
    if (!changed && changed.error().code != ErrorCode::kInvalidArgument) return changed;
    if (!change.outcome) return {};
    ++result_.compared;
    if (changed.ok() == (code == 0)) return {};
    result_.difference = "the change before frame " + std::to_string(change.request.next_frame()) +
                         ": recorded as " + (code == 0 ? "carried out" : outcome_text(*change.outcome)) +
                         "; replayed as " +
                         (changed ? "carried out" : "refused (" + changed.error().message + ")");
    return {};
  }

  ReplayResult& result() { return result_; }

 private:
  Status compare(const RecordedStep& step, const AnswerDigest& answer) {
    ++result_.compared;
    const AnswerDigest recorded = digest_of(*step.answer);
    if (recorded != answer)
      result_.difference = "frame " + std::to_string(step.frame) + " differs: recorded " +
                           describe(recorded) + "; replayed " + describe(answer);
    return {};
  }

  Status compare_refusal(const RecordedStep& step, const Result<AnswerDigest>& answer) {
    ++result_.compared;
    const v1::RecordedOutcome& recorded = step.answer->outcome();
    if (answer.ok() == (recorded.code() == 0)) return {};
    result_.difference = "frame " + std::to_string(step.frame) + " differs: recorded " +
                         (recorded.code() == 0 ? describe(digest_of(*step.answer)) : outcome_text(recorded)) +
                         "; replayed " +
                         (answer ? describe(answer.value()) : "refused (" + answer.error().message + ")");
    return {};
  }

  ReplayTarget& target_;
  std::uint64_t expected_;
  std::optional<AnswerDigest> last_;
  ReplayResult result_;
};

}  // namespace

Result<ReplayResult> replay(RecordedSession& recorded, ReplayTarget& target,
                            const std::function<void(std::uint64_t)>& progress) {
  Replay replay(recorded, target);
  ReplayResult& result = replay.result();
  while (result.difference.empty()) {
    auto event = recorded.next();
    if (!event) return event.error();
    if (!event.value()) break;
    const auto* step = std::get_if<RecordedStep>(&*event.value());
    const Status done = step ? replay.step(*step) : replay.change(std::get<RecordedChange>(*event.value()));
    if (!done) return Error{done.error().code, recorded.path() + ": " + done.error().message};
    progress(result.steps + result.placements);
  }
  result.defect = result.difference.empty() ? recorded.defect() : "";
  return std::move(result);
}

}  // namespace warmfront::client
