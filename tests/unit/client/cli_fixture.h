// SPDX-License-Identifier: Apache-2.0
// What tests of the command line share.
#pragma once

namespace warmfront::client {

inline constexpr const char* kScene = "'builtin:bart?triangles=1000'";
inline constexpr const char* kNearScene = "'builtin:cloth-ball?triangles=1000&frames=9'";

}  // namespace warmfront::client
