// SPDX-License-Identifier: Apache-2.0
// How gRPC's threads stand to those that compute.
#pragma once

namespace warmfront::server {

/// Whether the calling thread, when something wakes it, waits for a thread that computes to pause
/// (SCHED_BATCH) or interrupts it (SCHED_OTHER, as threads do). To be said where gRPC calls back: while more
/// frames wait than there are threads, each message that comes or goes would interrupt a step, some six
/// times a frame, and bring nothing forward. Costs a system call where the answer changes. Does nothing where
/// whoever started the daemon chose another policy, or the system forbids it. Thread-safe.
void yield_to_steps(bool to_steps);

}  // namespace warmfront::server
