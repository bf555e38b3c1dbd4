// SPDX-License-Identifier: Apache-2.0
// Why a request to the daemon failed: the engine's Error with what a client program needs to act on it. Plain
// values.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "engine/result.h"

namespace warmfront::server {

/// For programs; mirrors ErrorReason on the wire.
enum class Reason : std::uint8_t {
  kInvalidInput,
  kSessionNotFound,
  kSessionExists,
  kSessionAttached,
  kFrameOutOfOrder,
  kFrameChanged,
  kProtocol,
  kLimit,
  kDraining,
  kEngine,
  kTimeout,
  kCancelled,
  kUnauthenticated,
  kPermissionDenied,
  kDataLoss,
  kStateChanged,
};

struct Fault {
  ErrorCode code;
  Reason reason;
  std::string message;  ///< what, where (field, index), what to do
  std::optional<std::uint64_t> expected_frame = std::nullopt;
  const char* limit =
      "";  ///< for kLimit, the setting that was met, or what else there was too much of; a literal
  /// When trying again may help.
  std::optional<std::chrono::milliseconds> retry_after = std::nullopt;

  /// The session is gone, and with it every stream on it.
  bool session_lost() const { return reason == Reason::kSessionNotFound || engine_failed(); }
  /// The session is to be dropped.
  bool engine_failed() const { return reason == Reason::kEngine || reason == Reason::kDataLoss; }
};

/// The limit of that setting was met. With `passing`, because of what others do: trying again may help.
inline Fault limit_met(std::string message, const char* limit, bool passing) {
  // Frames are answered and sessions end: often enough for a second to make a difference.
  constexpr std::chrono::milliseconds kRetryAfter{1000};
  Fault fault{ErrorCode::kResourceExhausted, Reason::kLimit, std::move(message), std::nullopt, limit};
  if (passing) fault.retry_after = kRetryAfter;
  return fault;
}

/// The process has no memory for it now, and everything is as before. Never throws: without memory for the
/// words too, it has two, which need none.
inline Fault no_memory(const char* what) noexcept {
  try {
    return limit_met(std::string(what) +
                         ": the daemon has no memory for it now; the session is as before, try "
                         "again later, or use a smaller scene or fewer sessions",
                     "memory", true);
  } catch (...) {
    return limit_met("out of memory", "memory", true);
  }
}

/// A scene above the limit of setting `flag`; `field` says what there is too much of.
inline Fault too_large(const std::string& field, std::uint64_t value, std::uint64_t limit, const char* flag) {
  return limit_met(field + ": " + std::to_string(value) + " is above the daemon's limit of " +
                       std::to_string(limit) + "; split the scene, or raise --" + flag,
                   flag, false);
}

/// The limits of the engine that a request can meet, as they are named to programs.
inline constexpr const char* kMaxContacts = "max-contacts";      ///< by a step: a setting
inline constexpr const char* kAdjacentFaces = "adjacent-faces";  ///< by a scene: the engine's own

/// The engine's error as a fault; `where` is put before its message, e.g. "frame 7: ". `limit` is what was
/// met, if it is a limit.
inline Fault fault_from(const Error& error, const std::string& where = {}, const char* limit = "") {
  const Reason reason = error.code == ErrorCode::kResourceExhausted ? Reason::kLimit
                        : error.code == ErrorCode::kInternal        ? Reason::kEngine
                        : error.code == ErrorCode::kCancelled       ? Reason::kCancelled
                                                                    : Reason::kInvalidInput;
  Fault fault{error.code, reason, where + error.message};
  if (reason == Reason::kLimit) fault.limit = limit;
  return fault;
}

/// A T or a Fault.
template <class T>
class [[nodiscard]] Outcome {
 public:
  Outcome(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
  Outcome(Fault fault) : state_(std::in_place_index<1>, std::move(fault)) {}  // NOLINT: implicit by design

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  const Fault& fault() const { return std::get<1>(state_); }

 private:
  std::variant<T, Fault> state_;
};

}  // namespace warmfront::server
