// SPDX-License-Identifier: Apache-2.0
// A watch over what a client sends as HTTP/2 (RFC 9113), before gRPC sees it: gRPC 1.51 lets whoever can
// connect fill its memory and take its threads. Used by one thread at a time; allocates nothing but the table
// of silent_calls.h.
//
// What it bounds, and why that is enough. Let B be the bound on a header block.
// 1. A header block is B bytes long at most, in B / 16 KiB + 8 frames (CVE-2024-27316): gRPC keeps no more of
//    one than its limit for metadata in each frame, and never more than B of one that is unfinished.
// 2. No integer in it has more than 5 bytes after its first, no string is longer than B, and there are at
//    most B / 32 fields: what gRPC holds back of a field that is unfinished, and reads again as more comes,
//    ends.
// 3. A block that is begun ends within 10 seconds, or the next byte of it is the connection's last. When no
//    byte comes, gRPC's keepalive ends it: nothing may stand between a block's frames, no answer to a ping
//    either.
// 4. Of calls that are reset (CVE-2023-44487), over any time of t seconds, at most 2,000 + 200 t are begun
//    and left to gRPC to end; the others are no more than the streams that gRPC allows at once.
// 5. Every other frame that costs gRPC work and its sender nothing comes so and so often at most: over t
//    seconds twice what is stated first in http2_guard.cpp, and t times what is stated second. DATA with
//    something in it is left to gRPC's flow control, messages' limit and quota.
// 6. What is no HTTP/2 ends at its first wrong byte; before the whole preface and the first SETTINGS gRPC's
//    handshake timeout holds.
// 7. A call of which no whole message has come in its time is ended, as if its client had cancelled it: the
//    guard says which RST_STREAM are to go before what the client sends next, between two of its frames. Of
//    calls that the server has ended, which the guard cannot see, gRPC overlooks them. The time is longer
//    than the server's own for calls that it has begun, which tells the client; gRPC begins no unary call,
//    and no health watch, before its message is whole. What a client sends next comes soon: an answer to
//    gRPC's keepalive, or else that ends the connection. A frame that takes as long again is the connection's
//    last.
// 8. Before the client has acknowledged the settings, gRPC knows no bound on calls at once: it begins no more
//    than may be at once, or than RFC 9113 advises to allow.
// Each is per connection: how many connections an address has is bounded by peers.h, and how many there are
// by the files that the daemon may open.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

#include "server/process/bucket.h"
#include "server/process/silent_calls.h"

namespace warmfront::server {

class Http2Guard {
 public:
  using Clock = Bucket::Clock;
  using Now = Bucket::Now;

  /// What was wrong; kGood: nothing so far.
  enum Verdict : std::uint8_t {
    kGood,
    kPreface,
    kFrameOrder,
    kHeaderBlock,
    kFieldCoding,
    kSlowHeaders,
    kResets,
    kCalls,
    kPings,
    kSettings,
    kWindowUpdates,
    kSmallData,
    kEmptyData,
    kOtherFrames,
    kSilentCalls,
    kVerdicts
  };
  static constexpr std::array<const char*, kVerdicts> kNames{
      "none",           "preface",    "frame_order", "header_block", "field_coding",
      "slow_headers",   "resets",     "calls",       "pings",        "settings",
      "window_updates", "small_data", "empty_data",  "other_frames", "silent_calls"};

  struct Bounds {
    std::size_t max_metadata_bytes = 16 << 10;                          ///< as gRPC is told
    std::uint32_t max_streams = 128;                                    ///< likewise
    std::chrono::milliseconds first_message = std::chrono::minutes(8);  ///< the time that a call has for it
  };

  /// `now` is asked seldom; tests bring their own.
  explicit Http2Guard(const Bounds& bounds, Now now = &Clock::now);

  /// Whether next_read() may have something to say.
  bool has_silent_calls() const { return !silent_.empty(); }
  /// What is to be done when the next bytes are read: so many bytes of RST_STREAM are to go before them, and
  /// so many are to be read at most, all within `space` bytes.
  struct NextRead {
    std::size_t resets = 0;
    std::size_t most = 0;
  };
  NextRead next_read(std::size_t space);
  /// So many bytes as next_read() said last, to be called once bytes came and before receive().
  void write_resets(std::span<std::uint8_t> resets);

  /// The next bytes that came, cut anywhere. Once a verdict is not kGood it stays; the connection is to be
  /// ended before gRPC sees these bytes.
  Verdict receive(std::span<const std::uint8_t> bytes);

  Verdict verdict() const { return verdict_; }
  /// The connection began as TLS does, and these are not its HTTP/2: another guard sees what is decrypted.
  bool encrypted() const { return state_ == State::kEncrypted; }

 private:
  enum class State : std::uint8_t { kPreface, kEncrypted, kFrame, kPayload, kPriority, kFields, kMessage };
  /// Within a field of a header block: at its first byte, in an integer's further bytes, at a string's first
  /// byte, in a string.
  enum class Coding : std::uint8_t { kField, kInteger, kStringStart, kString };

  bool read_preface(std::span<const std::uint8_t>& bytes);
  void begin_frame(const std::uint8_t* header);
  void begin_data();
  void begin_headers(bool continuation);
  void begin_call();
  void end_payload();
  void read_fields(std::span<const std::uint8_t> bytes);
  void begin_field(std::uint8_t byte);
  void integer_read();
  void end_field();
  void take(Bucket& bucket, Verdict verdict, std::uint32_t count = 1) {
    if (!bucket.take(count, now_)) verdict_ = verdict;
  }

  // Constant after construction.
  Now now_;
  std::uint32_t max_block_bytes_, max_block_frames_, max_calls_at_first_;

  Verdict verdict_ = kGood;
  State state_ = State::kPreface;
  std::uint8_t preface_read_ = 0;

  // The frame.
  std::array<std::uint8_t, 9> header_{};
  std::uint8_t header_read_ = 0;
  std::uint8_t flags_ = 0;
  std::uint32_t stream_ = 0;
  std::uint32_t payload_left_ = 0;
  std::uint8_t priority_left_ = 0;

  // The header block.
  bool in_block_ = false;
  std::uint32_t block_bytes_ = 0, block_frames_ = 0, block_fields_ = 0;
  Clock::time_point block_began_{};  ///< zero until it was left unfinished
  Coding coding_ = Coding::kField;
  std::uint8_t integer_bytes_ = 0;
  std::uint64_t integer_ = 0;
  bool string_length_ = false;     ///< the integer is one; else an index or a table's size
  std::uint8_t strings_left_ = 0;  ///< of this field
  std::uint32_t string_left_ = 0;

  // The calls.
  bool settings_acknowledged_ = false;
  bool stalled_ = false;  ///< a frame does not end, and a call was silent long enough
  bool call_began_ = false;
  bool ends_call_ = false;  ///< this frame, once it is whole
  std::uint32_t last_call_ = 0, calls_at_first_ = 0;
  SilentCalls silent_;

  Bucket resets_, calls_, pings_, settings_, window_updates_, small_data_, empty_data_, others_;
};

}  // namespace warmfront::server
