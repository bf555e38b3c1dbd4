// SPDX-License-Identifier: Apache-2.0
// What is done in a history of a session over two daemons, at random.
#pragma once

#include <rapidcheck.h>

#include <cstdint>
#include <ostream>

namespace warmfront::test {

struct RemoteCommand {
  enum Kind : std::uint8_t {
    kFrame,
    kTwoFrames,  // sent before the answer to the first is taken
    kAdd,
    kChange,
    kWrongFrame,
    kWrongChange,
    kCut,
    kSwitch,  // to the other daemon
    kKill,    // the daemon in use, which is started again
    kFreeze,  // the daemon in use; the other one takes over
    kThaw,
    kTrial,
    kMaxStep,
    kLineSearch,  // trials of ever shorter motions, then a commit
    kCommit,      // of the last trial, or of none
    kNear,
    kTrialCommitStep,  // sent before the answer to the first is taken
    kFilters,
    kWrongFilters,
    kReplace,
    kWrongReplacement,
    kExcludedPairs,
    kOptions,
    kWrongOptions,
    kJourney,  // all is placed far away, or with another size
    kKinds
  };
  Kind kind = kFrame;
  std::uint32_t draw = 0;
  /// The daemon carries it out, but its answer is lost, and the other daemon takes over.
  bool lose_answer = false;
};

inline std::ostream& operator<<(std::ostream& out, const RemoteCommand& command) {
  constexpr const char* kNames[] = {"frame",
                                    "two frames",
                                    "add",
                                    "change",
                                    "wrong frame",
                                    "wrong change",
                                    "cut",
                                    "switch",
                                    "kill",
                                    "freeze",
                                    "thaw",
                                    "trial",
                                    "max_step",
                                    "line search",
                                    "commit",
                                    "near",
                                    "trial, commit and step",
                                    "filters",
                                    "wrong filters",
                                    "replace",
                                    "wrong replacement",
                                    "excluded pairs",
                                    "options",
                                    "wrong options",
                                    "journey"};
  return out << kNames[command.kind] << " drawn by " << command.draw
             << (command.lose_answer ? ", the answer is lost" : "") << "\n";
}

inline rc::Gen<RemoteCommand> any_command() {
  const auto kind =
      rc::gen::map(rc::gen::weightedOneOf<int>({{1, rc::gen::just(int{RemoteCommand::kFrame})},
                                                {1, rc::gen::just(int{RemoteCommand::kReplace})},
                                                {4, rc::gen::inRange<int>(0, RemoteCommand::kKinds)}}),
                   [](int k) { return static_cast<RemoteCommand::Kind>(k); });
  return rc::gen::build<RemoteCommand>(
      rc::gen::set(&RemoteCommand::kind, kind),
      rc::gen::set(&RemoteCommand::draw, rc::gen::inRange<std::uint32_t>(0, 1U << 30)),
      rc::gen::set(&RemoteCommand::lose_answer, rc::gen::weightedElement<bool>({{4, false}, {1, true}})));
}

}  // namespace warmfront::test
