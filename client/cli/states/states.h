// SPDX-License-Identifier: Apache-2.0
// What verbs that ask about states share: an input's frames, at each of which a session stands in turn. Used
// by the main thread only.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/filter_options.h"
#include "client/cli/frames/frame_steps.h"
#include "client/cli/frames/open_session.h"
#include "client/io/input.h"

namespace CLI {
class App;
}

namespace warmfront::client {

/// The arguments as given.
struct StateArguments {
  std::vector<std::string> inputs;
  SessionPlace place;
  std::string bodies = "declared";
  std::string frames;
  FilterArguments filters;

  Status check() const;
};

/// INPUT, --server, --threads, --bodies, --frames and --filter-*. `arguments` must outlive the parsing.
void add_state_arguments(CLI::App& app, StateArguments& arguments);

class States {
 public:
  /// Reads the first frame. Where it cannot, it says so and returns the exit code. `arguments` outlive this.
  std::optional<int> open(const StateArguments& arguments);

  std::size_t count() const { return steps_->step_count() + 1; }
  const SceneDescription& scene() const { return scene_; }
  /// Of the frame at hand, and its number.
  Positions positions() const { return steps_->end(); }
  std::uint64_t number() const { return steps_->number(); }

  /// Opens the session, calls `look` at each frame, and returns the exit code: 0, or that of the first
  /// failure, which is said.
  int each(const std::function<Status(AnySession&)>& look);

 private:
  const StateArguments* arguments_ = nullptr;
  std::unique_ptr<Input> input_;
  std::optional<FrameSteps> steps_;
  SceneDescription scene_;
};

}  // namespace warmfront::client
