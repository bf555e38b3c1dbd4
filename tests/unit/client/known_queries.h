// SPDX-License-Identifier: Apache-2.0
// Query files' text for tests of the command line. Pure functions.
#pragma once

#include <string>

namespace warmfront::client {

/// A vertex that falls from z = 1 to `z` (a fraction "NUM,DEN") over (x, 1/4), above a face with corners (0,
/// 0), (1, 0), (0, 1).
inline std::string falling_vertex(const std::string& x, const std::string& z, char truth) {
  std::string text;
  for (const std::string& at : {std::string("1,1"), z}) {
    text += x + ",1,4," + at + "," + truth + "\n";
    for (const char* corner : {"0,1,0,1,0,1,", "1,1,0,1,0,1,", "0,1,1,1,0,1,"})
      text += corner + std::string(1, truth) + "\n";
  }
  return text;
}

/// Two edges, the first of which, at `y`, falls from z = 1 to -1 onto the second (y from -1 to 1), or beside
/// it.
inline std::string falling_edge(const std::string& y, char truth) {
  std::string text;
  for (const char* z : {"1,1,", "-1,1,"}) {
    text += "-1,1," + y + "," + z + truth + "\n1,1," + y + "," + z + truth + "\n";
    for (const char* end : {"0,1,-1,1,0,1,", "0,1,1,1,0,1,"}) text += end + std::string(1, truth) + "\n";
  }
  return text;
}

}  // namespace warmfront::client
