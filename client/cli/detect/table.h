// SPDX-License-Identifier: Apache-2.0
// The table of `detect`, on stdout: a row a step, and their sums. Used by the main thread only.
#pragma once

#include "client/cli/detect/report_json.h"

namespace warmfront::client {

/// `half_spaces`: with a column for their contacts.
void print_detect_header(bool half_spaces);
void print_detect_row(const FrameReport& frame, bool half_spaces);
/// Of at least one step.
void print_detect_summary(const DetectReport& report);

}  // namespace warmfront::client
