// SPDX-License-Identifier: Apache-2.0
// Limits beside the memory that there is. Thread-safe.
#include "server/session/limits.h"

#include "server/units.h"

namespace warmfront::server {

std::vector<std::string> fit_to_memory(Limits& limits, std::size_t usable) {
  std::vector<std::string> words;
  if (limits.max_total_bytes > usable)
    words.push_back("max-total-bytes is " + describe_bytes(limits.max_total_bytes) +
                    ", and this process may use " + describe_bytes(usable) +
                    ": the system may end it before sessions are refused; lower it");
  const std::size_t most = std::min(limits.max_total_bytes, usable);
  if (limits.max_session_bytes > most) {
    words.push_back("max-session-bytes is lowered from " + describe_bytes(limits.max_session_bytes) + " to " +
                    describe_bytes(most) +
                    (most < limits.max_total_bytes ? ", which is all that this process may use"
                                                   : ", which is max-total-bytes"));
    limits.max_session_bytes = most;
  }
  return words;
}

}  // namespace warmfront::server
