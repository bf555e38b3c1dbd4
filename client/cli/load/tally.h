// SPDX-License-Identifier: Apache-2.0
// What a load measured: of one session, or of all together. Plain values; not thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "client/cli/load/histogram.h"
#include "client/lib/answer.h"

namespace warmfront::client::load {

/// A frame's time from when it was due to when its answer was there, part by part: they add up to it.
enum Part : std::size_t {
  kLate,    ///< due, and not sent: the answer before was not there, or this process was late
  kEncode,  ///< in this process
  kWire,    ///< what is left: gRPC and Protocol Buffers on both sides, and the network
  kQueue,   ///< in the daemon, between arrival and step
  kRefit,   ///< the step's stages, as StageTimes has them
  kFront,
  kElementary,
  kAdjacent,
  kRest,    ///< of the step, outside its stages
  kDecode,  ///< in this process
  kParts
};
inline constexpr std::array<const char*, kParts> kPartNames{
    "late", "encode", "wire", "queue", "refit", "front", "elementary", "adjacent", "rest of step", "decode"};

/// When a frame was due, sent and answered, in seconds from the load's start, and what it was.
struct FrameTimes {
  double due = 0;
  double sent = 0;
  double answered = 0;
  double own_late_ms = 0;  ///< of its lateness, what this process is to blame for
};

struct Tally {
  /// Frames that were due in the measured time.
  Histogram latency;     ///< from due to answered
  Histogram round_trip;  ///< from sent to answered
  Histogram own_late;    ///< due and free to be sent, and not sent
  std::array<Histogram, kParts> parts;
  std::uint64_t frames = 0;
  std::uint64_t contacts = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t received_bytes = 0;
  std::uint64_t unsent = 0;  ///< due before the end, and not sent by then

  /// The first step of each session, whenever it was; not among the above.
  Histogram cold;
  /// Uploading and building a session.
  Histogram create;

  // Over the whole run, the ramp, the warm-up and cold frames included.
  std::uint64_t all_frames = 0;
  std::uint64_t all_contacts = 0;
  std::uint64_t sessions_created = 0;
  std::uint64_t reconnects = 0;  ///< sessions taken up again after a stream, daemon or session was lost
  std::uint64_t rebuilds = 0;    ///< steps that built their front anew, beside the first of each session
  std::uint64_t capped = 0;      ///< steps whose front was beyond its cap
  std::map<std::string, std::uint64_t> errors;  ///< by canonical code
  std::uint64_t checked = 0;
  std::uint64_t different = 0;
  std::string first_difference;

  /// A frame that counts as measured.
  void measured(const FrameTimes& times, const Answer& answer);
  void error(const Error& error);
  std::uint64_t error_count() const;
  void merge(const Tally& other);
};

/// The canonical name of a code, as gRPC spells it: "RESOURCE_EXHAUSTED".
const char* canonical_name(ErrorCode code);

}  // namespace warmfront::client::load
