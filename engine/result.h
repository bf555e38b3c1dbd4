// SPDX-License-Identifier: Apache-2.0
// Result<T>: a value or an Error, which a caller cannot overlook. Values are as thread-safe as T.
#pragma once

#include <string>
#include <utility>
#include <variant>

namespace warmfront {

/// What kind of thing went wrong. The names follow the canonical gRPC codes, so that one table in the server
/// maps them.
enum class ErrorCode {
  kInvalidArgument,     ///< the input itself is bad; the message names the field and the first offender
  kFailedPrecondition,  ///< the input is good, but not in this state
  kResourceExhausted,   ///< a stated limit was met
  kUnimplemented,       ///< a feature this build does not have
  kCancelled,           ///< the caller asked to stop
  kInternal,            ///< an invariant broke
  kDataLoss,            ///< what was kept is broken, and cannot be made anew from what is left
  // The engine itself never gives these: they are what a service in between adds.
  kNotFound,          ///< no such session
  kAlreadyExists,     ///< the id is taken
  kAborted,           ///< someone else holds what was asked for, or changed it
  kDeadlineExceeded,  ///< not done in the time stated
  kUnauthenticated,   ///< it is not known who asks
  kPermissionDenied,  ///< it is known, and may not
  kUnavailable,       ///< the service cannot be reached, or is about to stop; trying again may help
};

/// An error: its kind, and one sentence that says what, where (field, index) and what to do.
struct Error {
  ErrorCode code;
  std::string message;
};

/// Either a T or an Error. `ok()` must be asked before `value()` or `error()`.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: implicit by design

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

/// Success, or an Error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)), ok_(false) {}  // NOLINT: implicit by design

  bool ok() const { return ok_; }
  explicit operator bool() const { return ok_; }
  const Error& error() const { return error_; }

 private:
  Error error_{};
  bool ok_ = true;
};
using Status = Result<void>;

inline Error invalid_argument(std::string message) {
  return {ErrorCode::kInvalidArgument, std::move(message)};
}

}  // namespace warmfront
