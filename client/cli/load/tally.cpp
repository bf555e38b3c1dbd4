// SPDX-License-Identifier: Apache-2.0
// Counting. Thread safety as stated in the header.
#include "client/cli/load/tally.h"

#include <algorithm>

#include "proto/wire/codes.h"

namespace warmfront::client::load {

void Tally::measured(const FrameTimes& times, const Answer& answer, Asked asked) {
  constexpr double kMilliseconds = 1e3;
  const double round_trip_ms = kMilliseconds * (times.answered - times.sent);
  const Travel& travel = answer.travel;
  const StageTimes& ms = answer.statistics.ms;
  std::array<double, kParts> part{};
  part[kLate] = kMilliseconds * (times.sent - times.due);
  part[kEncode] = travel.encode_ms;
  part[kQueue] = travel.queue_ms;
  part[kRefit] = ms.refit;
  part[kFront] = ms.front;
  part[kElementary] = ms.elementary;
  part[kAdjacent] = ms.adjacent;
  part[kRest] = std::max(0.0, ms.total - ms.refit - ms.front - ms.elementary - ms.adjacent);
  part[kDecode] = travel.decode_ms;
  // A frame resent after a resume may have been computed before it was last sent.
  part[kWire] =
      std::max(0.0, round_trip_ms - travel.encode_ms - travel.decode_ms - travel.queue_ms - ms.total);
  for (std::size_t p = 0; p < kParts; ++p) parts[p].record(part[p]);
  latency.record(kMilliseconds * (times.answered - times.due));
  latency_of[static_cast<std::size_t>(asked)].record(kMilliseconds * (times.answered - times.due));
  round_trip.record(round_trip_ms);
  own_late.record(times.own_late_ms);
  ++frames;
  contacts += answer.total();
  sent_bytes += travel.sent_bytes;
  received_bytes += travel.received_bytes;
}

void Tally::begin_measuring() {
  for (Histogram* histogram : {&latency, &round_trip, &own_late}) histogram->clear();
  for (Histogram& histogram : latency_of) histogram.clear();
  for (Histogram& histogram : parts) histogram.clear();
  frames = contacts = sent_bytes = received_bytes = 0;
}

void Tally::error(const Error& error) {
  ++errors[wire::canonical_name(wire::canonical_code(error.code))];
}

std::uint64_t Tally::error_count() const {
  std::uint64_t sum = 0;
  for (const auto& [code, count] : errors) sum += count;
  return sum;
}

void Tally::merge(const Tally& other) {
  latency.merge(other.latency);
  for (std::size_t k = 0; k < kAskedKinds; ++k) latency_of[k].merge(other.latency_of[k]);
  round_trip.merge(other.round_trip);
  own_late.merge(other.own_late);
  for (std::size_t p = 0; p < kParts; ++p) parts[p].merge(other.parts[p]);
  cold.merge(other.cold);
  create.merge(other.create);
  frames += other.frames;
  contacts += other.contacts;
  sent_bytes += other.sent_bytes;
  received_bytes += other.received_bytes;
  unsent += other.unsent;
  all_frames += other.all_frames;
  all_contacts += other.all_contacts;
  sessions_created += other.sessions_created;
  reconnects += other.reconnects;
  rebuilds += other.rebuilds;
  capped += other.capped;
  for (const auto& [code, count] : other.errors) errors[code] += count;
  checked += other.checked;
  different += other.different;
  if (first_difference.empty()) first_difference = other.first_difference;
}

}  // namespace warmfront::client::load
