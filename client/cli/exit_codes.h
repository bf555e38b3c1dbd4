// SPDX-License-Identifier: Apache-2.0
// What a verb's exit status means. Constants only.
#pragma once

namespace warmfront::client {

enum ExitCode : int {
  kExitOk = 0,      ///< done
  kExitNo = 1,      ///< done, and the answer is "no": a limit missed, a mismatch
  kExitFailed = 2,  ///< could not be done
  kExitUsage = 3,   ///< the command line itself is wrong
};

}  // namespace warmfront::client
