// SPDX-License-Identifier: Apache-2.0
// What a signal that ends the process leaves: whole rows on stdout, and no file half written. Thread-safe.
#pragma once

namespace warmfront::client {

/// From now on SIGINT, SIGTERM, SIGHUP and SIGPIPE end the process as they would by themselves, with the same
/// status, but first what is staged (StagedFile) is removed, stdout is flushed, between two rows, and stderr
/// is told which signal it was and what was not written (not of SIGPIPE). Waits for a row a second at most; a
/// second signal of the kind, but SIGPIPE, ends the process at once. Signals that are ignored stay ignored.
/// Call it once, before other threads.
void end_tidily();

/// Holds stdout for a row that is printed in several calls.
class WholeRow {
 public:
  WholeRow();
  ~WholeRow();
  WholeRow(const WholeRow&) = delete;
  WholeRow& operator=(const WholeRow&) = delete;
};

}  // namespace warmfront::client
