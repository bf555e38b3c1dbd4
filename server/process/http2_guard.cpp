// SPDX-License-Identifier: Apache-2.0
// Frame by frame; of header blocks, field by field. Thread safety as stated in the header.
#include "server/process/http2_guard.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace warmfront::server {
namespace {

constexpr std::string_view kPrefaceBytes = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
constexpr std::uint8_t kTlsRecord = 0x16;

enum Type : std::uint8_t {
  kData,
  kHeaders,
  kPriorityFrame,
  kResetStream,
  kSettingsFrame,
  kPushPromise,
  kPing,
  kGoAway,
  kWindowUpdate,
  kContinuation
};
enum Flag : std::uint8_t {
  kEndStream = 1,
  kAcknowledged = 1,
  kEndHeaders = 4,
  kPadded = 8,
  kHasPriority = 32
};

constexpr std::uint32_t kFrameBytes = 16384;  // as large as gRPC lets a client make one at first
constexpr std::uint32_t kFieldBytes = 32;     // that a field counts for at least (RFC 9113, 6.5.2)
constexpr std::uint8_t kIntegerBytes = 5;     // after the first: enough for 32 bits
constexpr std::chrono::seconds kBlockTime{10};
constexpr std::uint32_t kSmallDataBytes = 32;
constexpr std::uint32_t kLeastStreams = 100;  // that a server should allow (RFC 9113, 6.5.2)
constexpr std::size_t kResetBytes = 13;

}  // namespace

// Honest clients: one that streams small frames sends some 20,000 messages a second on one connection; one
// that receives a GB a second allows for it in windows of 32 KiB or more; Go measures the round trip by a
// ping as often as it takes; the settings change with the measured bandwidth, a few times.
Http2Guard::Http2Guard(const Bounds& bounds, Now now)
    : now_(now),
      max_block_bytes_(static_cast<std::uint32_t>(4 * bounds.max_metadata_bytes + 16384)),
      max_block_frames_(max_block_bytes_ / kFrameBytes + 8),
      max_calls_at_first_(std::max(bounds.max_streams, kLeastStreams)),
      silent_(bounds.max_streams, bounds.first_message),
      resets_(1000, 200, now()),
      calls_(50'000, 50'000, now()),
      pings_(10'000, 10'000, now()),
      settings_(200, 20, now()),
      window_updates_(50'000, 50'000, now()),
      small_data_(50'000, 50'000, now()),
      empty_data_(1000, 100, now()),
      others_(100, 10, now()) {}

Http2Guard::Verdict Http2Guard::receive(std::span<const std::uint8_t> bytes) {
  if (verdict_ != kGood || bytes.empty()) return verdict_;
  if (state_ == State::kPreface && !read_preface(bytes)) return verdict_;
  if (state_ == State::kEncrypted) return kGood;
  if (block_began_ != Clock::time_point{} && now_() - block_began_ > kBlockTime)
    return verdict_ = kSlowHeaders;
  if (stalled_) return verdict_ = kSilentCalls;
  while (verdict_ == kGood && !bytes.empty()) {
    if (state_ == State::kFrame) {
      if (header_read_ == 0 && bytes.size() >= header_.size()) {
        begin_frame(bytes.data());
        bytes = bytes.subspan(header_.size());
      } else {
        const std::size_t part = std::min(bytes.size(), header_.size() - header_read_);
        std::ranges::copy(bytes.first(part), header_.begin() + header_read_);
        header_read_ = static_cast<std::uint8_t>(header_read_ + part);
        bytes = bytes.subspan(part);
        if (header_read_ < header_.size()) break;
        header_read_ = 0;
        begin_frame(header_.data());
      }
    } else {
      std::size_t part = std::min<std::size_t>(bytes.size(), payload_left_);
      if (state_ == State::kPriority) {
        part = std::min<std::size_t>(part, priority_left_);
        priority_left_ = static_cast<std::uint8_t>(priority_left_ - part);
        if (priority_left_ == 0) state_ = State::kFields;
      } else if (state_ == State::kFields) {
        read_fields(bytes.first(part));
      } else if (state_ == State::kMessage) {
        if (!silent_.read(bytes.first(part))) state_ = State::kPayload;
      }
      payload_left_ -= static_cast<std::uint32_t>(part);
      bytes = bytes.subspan(part);
    }
    if (verdict_ == kGood && state_ != State::kFrame && payload_left_ == 0) end_payload();
  }
  if (verdict_ == kGood && in_block_ && block_began_ == Clock::time_point{}) block_began_ = now_();
  if (call_began_) {
    call_began_ = false;
    // Of calls that are silent no more nobody asks when they began.
    if (!silent_.empty()) silent_.note_time(now_());
  }
  return verdict_;
}

Http2Guard::NextRead Http2Guard::next_read(std::size_t space) {
  NextRead read{0, space};
  if (silent_.empty() || verdict_ != kGood) return read;
  const Clock::time_point now = now_();
  const std::size_t overdue = silent_.overdue(now);
  if (overdue == 0) return read;
  if (state_ == State::kFrame && header_read_ == 0 && !in_block_) {
    const std::size_t room = space == 0 ? 0 : (space - 1) / kResetBytes;
    read.resets = std::min(overdue, room) * kResetBytes;
    read.most -= read.resets;
    return read;
  }
  // Up to the end of what has begun, so that the next read is between two frames.
  const std::size_t left = state_ == State::kFrame ? header_.size() - header_read_ : payload_left_;
  read.most = std::min(space, left);
  stalled_ = silent_.long_overdue(now);
  return read;
}

void Http2Guard::write_resets(std::span<std::uint8_t> resets) {
  constexpr std::uint8_t kCancel = 8;
  for (; resets.size() >= kResetBytes && !silent_.empty(); resets = resets.subspan(kResetBytes)) {
    const std::uint32_t stream = silent_.take_oldest();
    const std::array<std::uint8_t, kResetBytes> frame{0,
                                                      0,
                                                      4,
                                                      kResetStream,
                                                      0,
                                                      static_cast<std::uint8_t>(stream >> 24),
                                                      static_cast<std::uint8_t>(stream >> 16),
                                                      static_cast<std::uint8_t>(stream >> 8),
                                                      static_cast<std::uint8_t>(stream),
                                                      0,
                                                      0,
                                                      0,
                                                      kCancel};
    std::ranges::copy(frame, resets.begin());
  }
}

bool Http2Guard::read_preface(std::span<const std::uint8_t>& bytes) {
  if (preface_read_ == 0 && bytes.front() == kTlsRecord) {
    state_ = State::kEncrypted;
    return false;
  }
  const std::size_t part = std::min(bytes.size(), kPrefaceBytes.size() - preface_read_);
  for (std::size_t i = 0; i < part; ++i)
    if (bytes[i] != static_cast<std::uint8_t>(kPrefaceBytes[preface_read_ + i])) {
      verdict_ = kPreface;
      return false;
    }
  preface_read_ = static_cast<std::uint8_t>(preface_read_ + part);
  bytes = bytes.subspan(part);
  if (preface_read_ == kPrefaceBytes.size()) state_ = State::kFrame;
  return state_ == State::kFrame;
}

void Http2Guard::begin_frame(const std::uint8_t* header) {
  payload_left_ =
      static_cast<std::uint32_t>(header[0]) << 16 | static_cast<std::uint32_t>(header[1]) << 8 | header[2];
  flags_ = header[4];
  stream_ = static_cast<std::uint32_t>(header[5] & 127) << 24 | static_cast<std::uint32_t>(header[6]) << 16 |
            static_cast<std::uint32_t>(header[7]) << 8 | header[8];
  state_ = State::kPayload;
  const std::uint8_t type = header[3];
  if (in_block_ != (type == kContinuation)) {
    verdict_ = kFrameOrder;
    return;
  }
  switch (type) {
    case kData:
      return begin_data();
    case kHeaders:
    case kContinuation:
      return begin_headers(type == kContinuation);
    case kResetStream:
      silent_.end(stream_);
      return take(resets_, kResets);
    case kSettingsFrame:
      if ((flags_ & kAcknowledged) != 0) settings_acknowledged_ = true;
      return take(settings_, kSettings, 1 + payload_left_ / 60);
    case kPing:
      return take(pings_, kPings);
    case kWindowUpdate:
      return take(window_updates_, kWindowUpdates);
    default:
      return take(others_, kOtherFrames);
  }
}

void Http2Guard::begin_data() {
  if (payload_left_ == 0 && (flags_ & kEndStream) == 0)
    take(empty_data_, kEmptyData);
  else if (payload_left_ < kSmallDataBytes)
    take(small_data_, kSmallData);
  // gRPC knows nothing of padding here either, and ends the call.
  ends_call_ = (flags_ & kEndStream) != 0;
  if (silent_.begin_data(stream_)) state_ = State::kMessage;
}

void Http2Guard::begin_call() {
  take(calls_, kCalls);
  if ((flags_ & kEndStream) != 0) silent_.end(stream_);
  // What gRPC takes for a new call. Others it overlooks, or they end one.
  if ((stream_ & 1) == 0 || stream_ <= last_call_) return;
  last_call_ = stream_;
  if (!settings_acknowledged_ && ++calls_at_first_ > max_calls_at_first_) verdict_ = kCalls;
  if ((flags_ & kEndStream) != 0) return;
  call_began_ = true;
  if (!silent_.begin(stream_)) verdict_ = kSilentCalls;
}

void Http2Guard::begin_headers(bool continuation) {
  state_ = State::kFields;
  if (!continuation) {
    begin_call();
    in_block_ = true;
    block_bytes_ = block_frames_ = block_fields_ = 0;
    coding_ = Coding::kField;
    // gRPC knows nothing of padding, and would take it for fields: nobody who talks to it sends any.
    if ((flags_ & kPadded) != 0) verdict_ = kFrameOrder;
    if ((flags_ & kHasPriority) != 0) {
      state_ = State::kPriority;
      priority_left_ = 5;
    }
  }
  block_bytes_ += std::min(payload_left_, max_block_bytes_ + 1);
  if (block_bytes_ > max_block_bytes_ || ++block_frames_ > max_block_frames_) verdict_ = kHeaderBlock;
}

void Http2Guard::end_payload() {
  const bool fields = state_ == State::kFields || state_ == State::kPriority;
  state_ = State::kFrame;
  // Not before: its last frame may be long in coming.
  if (std::exchange(ends_call_, false)) silent_.end(stream_);
  if (!fields || (flags_ & kEndHeaders) == 0) return;
  if (coding_ != Coding::kField) verdict_ = kFieldCoding;
  in_block_ = false;
  block_began_ = {};
}

void Http2Guard::read_fields(std::span<const std::uint8_t> bytes) {
  for (std::size_t at = 0; at < bytes.size() && verdict_ == kGood;) {
    if (coding_ == Coding::kString) {
      const std::size_t part = std::min<std::size_t>(bytes.size() - at, string_left_);
      string_left_ -= static_cast<std::uint32_t>(part);
      at += part;
      if (string_left_ == 0) end_field();
      continue;
    }
    const std::uint8_t byte = bytes[at++];
    if (coding_ == Coding::kField) {
      begin_field(byte);
    } else if (coding_ == Coding::kStringStart) {
      string_length_ = true;
      integer_ = byte & 127;
      integer_bytes_ = 0;
      if (integer_ < 127)
        integer_read();
      else
        coding_ = Coding::kInteger;
    } else {
      integer_ += static_cast<std::uint64_t>(byte & 127) << (7 * integer_bytes_);
      ++integer_bytes_;
      if ((byte & 128) == 0)
        integer_read();
      else if (integer_bytes_ == kIntegerBytes)
        verdict_ = kFieldCoding;
    }
  }
}

void Http2Guard::begin_field(std::uint8_t byte) {
  // RFC 7541, 6: indexed, literal to be indexed, a table's size, literal.
  const bool indexed = byte >= 128;
  const bool table_size = byte >= 32 && byte < 64;
  const std::uint8_t prefix = indexed ? 127 : byte >= 64 ? 63 : table_size ? 31 : 15;
  const std::uint8_t value = byte & prefix;
  if (++block_fields_ > max_block_bytes_ / kFieldBytes) {
    verdict_ = kHeaderBlock;
    return;
  }
  strings_left_ = indexed || table_size ? 0 : value == 0 ? 2 : 1;
  string_length_ = false;
  integer_ = value;
  integer_bytes_ = 0;
  if (value == prefix)
    coding_ = Coding::kInteger;
  else
    integer_read();
}

void Http2Guard::integer_read() {
  if (!string_length_) {
    coding_ = strings_left_ > 0 ? Coding::kStringStart : Coding::kField;
    return;
  }
  if (integer_ > max_block_bytes_) {
    verdict_ = kHeaderBlock;
    return;
  }
  string_left_ = static_cast<std::uint32_t>(integer_);
  coding_ = Coding::kString;
  if (string_left_ == 0) end_field();
}

void Http2Guard::end_field() {
  --strings_left_;
  coding_ = strings_left_ > 0 ? Coding::kStringStart : Coding::kField;
}

}  // namespace warmfront::server
