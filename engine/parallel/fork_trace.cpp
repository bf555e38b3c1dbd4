// SPDX-License-Identifier: Apache-2.0
#include "engine/parallel/fork_trace.h"

namespace warmfront {

constinit thread_local ForkTrace* ForkTrace::current = nullptr;

ForkTrace::Recording::Recording(ForkTrace& trace) {
  current = &trace;
  trace.began_ = Clock::now();
}

ForkTrace::Recording::~Recording() {
  current->end_strand();
  current = nullptr;
}

}  // namespace warmfront
