// SPDX-License-Identifier: Apache-2.0
// A session of either client library, driven by operations. Used by one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/lib/answer.h"
#include "engine/result.h"
#include "tests/support/accepted_state.h"
#include "tests/support/operations.h"

namespace warmfront::test {

/// The functions do what those of client::Session and client::Client do.
class SessionDriver {
 public:
  virtual ~SessionDriver() = default;

  /// The session before this one, if any, was closed.
  virtual Status create(const testing::AcceptedState& state, const ColliderOptions& options) = 0;
  /// As the operation says: a step, a trial, or max_step, of which the answer is the trial's.
  virtual Result<client::Answer> step(const testing::StepOperation& operation) = 0;
  virtual Status submit(const testing::StepOperation& operation) = 0;
  virtual Result<client::Answer> proximity(const testing::NearOperation&) {
    return Error{ErrorCode::kUnimplemented, "this driver knows no proximity"};
  }
  /// Does it know trials, commits and proximity?
  virtual bool asks() const { return false; }
  virtual Result<CommitResult> commit(double) {
    return Error{ErrorCode::kUnimplemented, "this driver knows no commits"};
  }
  virtual Status submit_commit(double) {
    return Error{ErrorCode::kUnimplemented, "this driver knows no commits"};
  }
  virtual Result<client::Answer> next_answer() = 0;
  virtual Result<std::uint32_t> add_body(const testing::AddOperation& add) = 0;
  virtual Status change_body(std::uint32_t index, const Body& body) = 0;
  virtual Status change_filters(const PairFilters& filters) = 0;
  virtual Status change_excluded_pairs(const std::vector<std::array<std::uint32_t, 2>>& pairs) = 0;
  virtual Status change_options(const ColliderOptions& options) = 0;
  virtual Status replace(const ReplaceElements& change) = 0;
  virtual Status replace(const ReplaceBody& change) = 0;
  virtual Status close() = 0;

  /// Are positions and poses float32? What is given is such numbers then.
  virtual bool single() const { return false; }

  /// Where the client says that everything is.
  struct State {
    std::vector<double> positions;
    std::vector<BodyPose> poses;
  };
  virtual Result<State> state() = 0;

  virtual std::string id() const = 0;
  virtual std::uint32_t window() const = 0;
};

/// The C++ client's, connected to `address` when a session is made.
std::unique_ptr<SessionDriver> drive_cpp(const std::string& address);
/// The same, whose sessions are of float32.
std::unique_ptr<SessionDriver> drive_cpp_in_float32(const std::string& address);
/// The Python client's, in a process of its own.
std::unique_ptr<SessionDriver> drive_python(const std::string& address);

}  // namespace warmfront::test
