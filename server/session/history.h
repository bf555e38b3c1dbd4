// SPDX-License-Identifier: Apache-2.0
// What a session has carried out: where it stands, what may be repeated, and which trial may be committed.
// Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/session/admitted_frame.h"
#include "server/session/change_order.h"
#include "server/session/frame_sequence.h"
#include "server/session/state_digest.h"

namespace warmfront::server {

/// Of an answer that is longer than who asks can be told.
Error answer_too_long(std::size_t bytes);
/// The limit that it meets.
inline constexpr const char* kMaxMessageBytes = "max-message-bytes";

class SessionHistory {
 public:
  /// The state in which the session was created.
  explicit SessionHistory(const SessionState& created)
      : frames_(created.frame), standing_{created, std::nullopt} {}

  const Standing& standing() const { return standing_; }
  const SessionState& now() const { return standing_.now; }
  const FrameSequence& frames() const { return frames_; }

  /// The answer to the last frame, for one of its number again. ABORTED when that has other content.
  FrameOutcome repeated(const AdmittedFrame& frame) const;
  /// The content of the last frame takes so much memory.
  std::size_t memory_bytes() const;
  /// The frame was answered, and is the session's last; there is no trial then. `content` is that of the last
  /// one before it afterwards, if there was one. Cannot fail.
  const std::shared_ptr<const Answer>& finish(std::shared_ptr<const Answer> answer,
                                              std::optional<FrameContent>& content) noexcept;

  /// A digest of what the last trial was about, where it may be committed.
  const std::optional<std::uint64_t>& trial() const { return trial_; }
  void keep_trial(std::uint64_t digest) { trial_ = digest; }
  void forget_trial() { trial_.reset(); }

  /// The answer to an order whose key is that of the last one that was carried out, and had one:
  /// INVALID_ARGUMENT when its changes were others.
  std::optional<Outcome<SessionState>> repeated(const ChangeOrder& order) const;
  /// The order was carried out. Cannot fail.
  const SessionState& finish(ChangeOrder& order) noexcept;

 private:
  struct DoneOrder {
    std::string key;
    std::uint64_t digest;
    SessionState state;
  };

  FrameSequence frames_;
  Standing standing_;
  std::shared_ptr<const Answer> last_answer_;
  std::optional<FrameContent> last_content_;  // what it answers
  std::optional<std::uint64_t> trial_;
  std::optional<DoneOrder> done_order_;
};

}  // namespace warmfront::server
