// SPDX-License-Identifier: Apache-2.0
// What all calls of a daemon share. Each part is thread-safe; the context itself is constant after
// construction.
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>

#include "engine/workers.h"
#include "server/auth/guard.h"
#include "server/log.h"
#include "server/observe/audit.h"
#include "server/observe/metrics.h"
#include "server/observe/repeats.h"
#include "server/observe/tracer.h"
#include "server/process/lifecycle.h"
#include "server/session/account.h"
#include "server/session/gate.h"
#include "server/session/limits.h"
#include "server/session/runner.h"
#include "server/session/store.h"
#include "server/session/tenants.h"
#include "server/transport/errors.h"
#include "server/transport/parse_room.h"
#include "server/transport/recordings.h"
#include "server/transport/stream_memory.h"

namespace warmfront::server {

struct Context {
  Context(const Limits& limits_in, int threads, Log& log_in, Guard& guard_in)
      : limits(limits_in),
        log(log_in),
        guard(guard_in),
        workers(std::make_shared<Workers>(threads, Workers::Bounds::kProcess)),
        budget(limits.max_total_bytes),
        streams(limits.max_open_streams),
        frames(limits.max_frames_in_flight),
        tenants(default_quota(limits, guard.authenticates()), streams, frames),
        store(limits.max_sessions),
        // Two at least, so that a long step does not hold up the building of a session.
        runner(std::max(2, workers->threads()), {polling_threads() - 1, packet_threads()}, kOverrun) {}

  /// Three times what a short task takes, on a machine that does other things as well; and a long one's share
  /// of time in which a person waits.
  static constexpr Runner::Overrun kOverrun{{std::chrono::milliseconds(30), std::chrono::milliseconds(500)}};

  /// On how many threads gRPC 1.51 runs reactions (CallbackAlternativeCQ in completion_queue_cc.cc); all but
  /// one may be taken by brief steps.
  static int polling_threads() {
    return std::clamp(static_cast<int>(std::thread::hardware_concurrency() / 2), 2, 16);
  }

  /// As many as compute: each may take the steps of its clients. Two at least (PacketSockets::listen()).
  int packet_threads() const { return std::max(2, workers->threads()); }

  /// Who calls. A call of nobody known leaves a line in the log.
  Outcome<Principal> identify(const grpc::ServerContextBase& call);

  /// The status that ends a call or a frame; counted.
  grpc::Status refuse(const Fault& fault, Tenant* tenant = nullptr) {
    count_refused(fault, tenant);
    return to_grpc(fault);
  }
  /// `tenant` is whose call or frame it was, where that is known.
  void count_refused(const Fault& fault, Tenant* tenant) {
    metrics.refused_with(fault);
    if (tenant != nullptr) tenant->refused.fetch_add(1, std::memory_order_relaxed);
  }

  const Limits limits;
  Log& log;
  Guard& guard;
  const std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
  const std::shared_ptr<Workers> workers;
  Lifecycle lifecycle;
  Metrics metrics;
  Budget budget;
  ParseRoom parsing{limits.max_message_bytes};
  Gate streams;  ///< StreamSteps calls
  Gate frames;   ///< accepted and not yet computed
  Tenants tenants;
  Store store;
  Repeats unknown_callers, refused_creates;    ///< their lines in the log
  std::atomic<std::uint64_t> shared_bytes{0};  ///< of memory that streams share with their clients
  MemoryDesk* memory_desk = nullptr;       ///< null where no memory is shared; set before the first call
  std::shared_ptr<Recordings> recordings;  ///< null where nothing is recorded; set before the first call
  std::unique_ptr<Audit> audit;            ///< set before the first call
  std::unique_ptr<Tracer> tracer;          ///< null where nothing is traced; set before the first call
  Runner runner;                           // last: its threads use all of the above until it has joined them
};

}  // namespace warmfront::server
