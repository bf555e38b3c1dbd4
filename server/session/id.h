// SPDX-License-Identifier: Apache-2.0
// A session's name: a UUID that the client chose. Plain value.
#pragma once

#include <compare>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "server/fault.h"

namespace warmfront::server {

class SessionId {
 public:
  /// `text` is 8-4-4-4-12 hexadecimal digits; letters are lowered. INVALID_ARGUMENT otherwise.
  static Outcome<SessionId> parse(std::string_view text);

  const std::string& text() const { return text_; }
  friend auto operator<=>(const SessionId&, const SessionId&) = default;

 private:
  explicit SessionId(std::string text) : text_(std::move(text)) {}
  std::string text_;
};

}  // namespace warmfront::server
