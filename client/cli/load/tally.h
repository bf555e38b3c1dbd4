// SPDX-License-Identifier: Apache-2.0
// Measurements of one session, or of all together. Plain values; not thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "client/cli/load/histogram.h"
#include "client/cli/load/mix.h"
#include "client/lib/answer.h"

namespace warmfront::client::load {

/// Parts of a frame's time from due to answered; they add up to it.
enum Part : std::size_t {
  kLate,    ///< due, but not sent: the previous answer was missing, or this process was late
  kEncode,  ///< in this process
  kWire,    ///< the remainder: gRPC and Protocol Buffers on both sides, and the network
  kQueue,   ///< in the daemon, between arrival and step
  kRefit,   ///< the step's stages, as in StageTimes
  kFront,
  kElementary,
  kAdjacent,
  kRest,    ///< of the step, outside its stages
  kDecode,  ///< in this process
  kParts
};
inline constexpr std::array<const char*, kParts> kPartNames{
    "late", "encode", "wire", "queue", "refit", "front", "elementary", "adjacent", "rest of step", "decode"};

/// Times at which a frame was due, sent and answered, in seconds from the load's start, and its size.
struct FrameTimes {
  double due = 0;
  double sent = 0;
  double answered = 0;
  double own_late_ms = 0;  ///< the part of its lateness caused by this process
};

struct Tally {
  /// Frames that were due in the measured period; of a mix, questions, each of which counts as a frame.
  Histogram latency;                              ///< from due to answered
  std::array<Histogram, kAskedKinds> latency_of;  ///< the same by what was asked
  Histogram round_trip;                           ///< from sent to answered
  Histogram own_late;                             ///< due and free to be sent, but not sent
  std::array<Histogram, kParts> parts;
  std::uint64_t frames = 0;
  std::uint64_t contacts = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t received_bytes = 0;
  std::uint64_t unsent = 0;  ///< due before the end, but not sent by then

  /// The first step of each session, in any period; not included above.
  Histogram cold;
  /// Uploading and building a session.
  Histogram create;

  // Over the whole run, including ramp, warm-up and cold frames.
  std::uint64_t all_frames = 0;
  std::uint64_t all_contacts = 0;
  std::uint64_t sessions_created = 0;
  std::uint64_t reconnects = 0;  ///< sessions resumed after a stream, daemon or session was lost
  std::uint64_t rebuilds = 0;    ///< steps that rebuilt their front, except the first of each session
  std::uint64_t capped = 0;      ///< steps whose front exceeded its cap
  std::map<std::string, std::uint64_t> errors;  ///< by canonical code
  std::uint64_t checked = 0;
  std::uint64_t different = 0;
  std::string first_difference;

  /// A frame that counts as measured.
  void measured(const FrameTimes& times, const Answer& answer, Asked asked = Asked::kStep);
  /// Forgets those that came before, and keeps the memory that they took: 64 sessions that take theirs all at
  /// once, when the measured period begins, would keep each other and the daemon from their cores.
  void begin_measuring();
  void error(const Error& error);
  std::uint64_t error_count() const;
  void merge(const Tally& other);
};

}  // namespace warmfront::client::load
