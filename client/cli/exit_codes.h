// SPDX-License-Identifier: Apache-2.0
// Exit codes of all verbs. A signal ends a verb as it would any program (interrupt.h). Constants only.
#pragma once

namespace warmfront::client {

enum ExitCode : int {
  kExitOk = 0,      ///< done
  kExitNo = 1,      ///< done, and the answer is "no": a limit missed, a mismatch
  kExitFailed = 2,  ///< not done
  kExitUsage = 3,   ///< the command line is invalid
};

}  // namespace warmfront::client
