// SPDX-License-Identifier: Apache-2.0
// Tokens of two users and an administrator.
#pragma once

namespace warmfront::test {

inline constexpr const char* kAliceToken = "alice-0123456789abcdef";
inline constexpr const char* kBobToken = "bob-0123456789abcdef";
inline constexpr const char* kRootToken = "root-0123456789abcdef";

}  // namespace warmfront::test
