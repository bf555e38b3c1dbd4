// SPDX-License-Identifier: Apache-2.0
// An array that an upload announces and then brings in chunks of bytes. An array is used by one thread at a
// time.
#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/result.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::wire {

/// As they travel; valid as long as the values, unchanged.
template <class T>
std::string_view as_bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// Calls `send` with each message of an upload that brings these bytes, `chunk` at most in each, put there by
/// `set(request, bytes)`; stops, and returns false, where `send` does.
template <class Send, class Set>
bool send_chunks(std::string_view bytes, std::size_t chunk, Send& send, Set set) {
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    v1::CreateSessionRequest request;
    set(request, std::string(bytes.substr(at, chunk)));
    if (!send(request)) return false;
  }
  return true;
}

/// Memory grows with what arrives, never with what was announced.
template <class T>
class ChunkedArray {
 public:
  /// Of so many values; `field` is its name in messages.
  explicit ChunkedArray(std::string field, std::size_t values = 0)
      : field_(std::move(field)), expected_(values * sizeof(T)) {}

  /// Takes the next bytes. kInvalidArgument for some beyond what was announced, of which nothing is taken.
  Status append(std::string_view bytes) {
    if (bytes.size() > expected_ - received_)
      return invalid_argument(field_ + ": " + std::to_string(received_ + bytes.size()) + " bytes, but " +
                              std::to_string(expected_) + " are announced");
    if (bytes.empty()) return {};
    const std::size_t end = received_ + bytes.size();
    values_.resize((end + sizeof(T) - 1) / sizeof(T));
    std::memcpy(reinterpret_cast<char*>(values_.data()) + received_, bytes.data(), bytes.size());
    received_ = end;
    return {};
  }
  /// kInvalidArgument unless everything announced is there.
  Status complete() const {
    if (received_ == expected_) return {};
    return invalid_argument(field_ + ": the upload ended after " + std::to_string(received_) + " of " +
                            std::to_string(expected_) + " bytes");
  }
  /// Once complete.
  std::vector<T> take() { return std::exchange(values_, {}); }

 private:
  std::string field_;
  std::size_t expected_;  // bytes
  std::size_t received_ = 0;
  std::vector<T> values_;
};

}  // namespace warmfront::wire
