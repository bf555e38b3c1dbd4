// SPDX-License-Identifier: Apache-2.0
// Result<T>: a value or an Error, which a caller must check. Values are as thread-safe as T.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace warmfront {

/// Kind of an error. The names follow the canonical gRPC codes, so that one table in the server maps them.
enum class ErrorCode {
  kInvalidArgument,     ///< the input is invalid; the message names the field and the first offender
  kFailedPrecondition,  ///< the input is valid, but not in this state
  kResourceExhausted,   ///< a stated limit was exceeded
  kUnimplemented,       ///< this build lacks the feature
  kCancelled,           ///< the caller cancelled
  kInternal,            ///< an invariant does not hold
  kDataLoss,            ///< stored data are broken and cannot be recomputed
  // Added by a service; the engine itself never returns these.
  // The engine itself never gives these: they are what a service in between adds.
  kNotFound,          ///< no such session
  kAlreadyExists,     ///< the id is in use
  kAborted,           ///< another caller holds the resource, or changed it
  kDeadlineExceeded,  ///< not done in the stated time
  kUnauthenticated,   ///< the caller is not authenticated
  kPermissionDenied,  ///< the caller is authenticated, but not permitted
  kUnavailable,       ///< the service is unreachable or about to stop; a retry may help
};

/// An error: its kind, and one sentence that says what, where (field, index) and how to correct it.
struct Error {
  ErrorCode code;
  std::string message;
};

/// Thrown by value() of a Result that holds an error, so that a program that did not check ok() ends with the
/// error's own message. Never caught in this project: check ok() first.
class BadResultAccess : public std::logic_error {
 public:
  explicit BadResultAccess(Error error)
      : std::logic_error("value() of a Result that holds an error (ask ok() first): " + error.message),
        error_(std::move(error)) {}

  const Error& error() const { return error_; }

 private:
  Error error_;
};

namespace result_detail {
// Out of line, so that value() stays a compare and a load.
[[noreturn, gnu::noinline, gnu::cold]] inline void throw_bad_access(const Error& error) {
  throw BadResultAccess(error);
}
[[noreturn, gnu::noinline, gnu::cold]] inline void throw_no_error() {
  throw std::logic_error("error() of a Result that holds a value; ask ok() first");
}
}  // namespace result_detail

/// Either a T or an Error. Check ok() before value(), which otherwise throws BadResultAccess, or error(),
/// which otherwise throws std::logic_error.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: implicit by design

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& value() & { return *checked(std::get_if<0>(&state_)); }
  const T& value() const& { return *checked(std::get_if<0>(&state_)); }
  T&& value() && { return std::move(*checked(std::get_if<0>(&state_))); }
  const Error& error() const {
    if (ok()) result_detail::throw_no_error();
    return *std::get_if<1>(&state_);
  }

 private:
  template <class Pointer>
  Pointer checked(Pointer value) const {
    if (!value) result_detail::throw_bad_access(*std::get_if<1>(&state_));
    return value;
  }

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
