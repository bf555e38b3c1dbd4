// SPDX-License-Identifier: Apache-2.0
// A collider and the model that it is compared with, through a history of operations.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "tests/property/session_history_draws.h"
#include "tests/support/accepted_state.h"
#include "tests/support/carry_out.h"

namespace warmfront::testing {

class History {
 public:
  /// Small scenes are compared with brute force, large ones with a collider that keeps nothing.
  enum class Scenes : std::uint8_t { kSmall, kLarge };
  History(std::uint64_t seed, std::shared_ptr<Workers> workers, Scenes scenes = Scenes::kSmall);
  void take(const Command& command);
  /// A session is charged memory_bytes(): no less than what the allocator holds for it.
  void end();

 private:
  void ask(Draws& draws, StepOperation::As as, const Fault& fault);
  void place(Draws& draws, const Fault& fault);
  bool fits_float32() const;
  CommitOperation draw_commit(Draws& draws) const;
  void line_search(Draws& draws, const Fault& fault);
  Outcome right(const Operation& operation) const;
  Outcome by_a_fresh_one(const Operation& operation) const;
  void carry(const Operation& operation, const Fault& fault);
  void accept(const Operation& operation);
  void change_options(Draws& draws, const Fault& fault);
  void wrong_options(Draws& draws, const Fault& fault);
  void refuse(const Operation& operation, const Fault& fault, ErrorCode code = ErrorCode::kInvalidArgument);
  void refuse_one_of(const ChangesOperation& changes, const Fault& fault);
  void forget_trial(const Operation& failed);
  static bool failed_by(const Fault& fault, const Outcome& outcome);
  void expect_accepted_state(const Operation& after);
  [[noreturn]] static void fail(const Operation& operation, const std::string& what);
  void glide(Draws& draws, const Fault& fault);
  void journey(Draws& draws, const Fault& fault);
  void noise(Draws& draws, const Fault& fault);
  void outlier(Draws& draws, const Fault& fault);
  static StepOperation everything(const std::vector<double>& positions);
  bool movable(std::uint32_t vertex) const;
  void change(Draws& draws, const Fault& fault);
  ChangeOperation wrong_change(Draws& draws) const;
  AddOperation wrong_addition(Draws& draws) const;

  const std::shared_ptr<Workers> workers_;
  const Scenes scenes_;
  const std::size_t most_bodies_ = scenes_ == Scenes::kLarge ? 200 : 8;
  Draws draws_;
  AcceptedState state_;
  ColliderOptions options_;
  std::unique_ptr<Collider> collider_;
};

}  // namespace warmfront::testing
