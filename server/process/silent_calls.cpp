// SPDX-License-Identifier: Apache-2.0
// A sorted table. Thread safety as stated in the header.
#include "server/process/silent_calls.h"

#include <algorithm>
#include <new>

namespace warmfront::server {
namespace {

constexpr std::uint8_t kPrefixBytes = 5;
constexpr std::size_t kFirstRoom = 16;

}  // namespace

bool SilentCalls::grow() {
  const std::size_t room = std::min(std::max(2 * room_, kFirstRoom), 2 * most_);
  if (room <= count_) return false;
  std::unique_ptr<Call[]> calls(new (std::nothrow) Call[room]);
  if (calls == nullptr) return false;
  std::copy_n(calls_.get(), count_, calls.get());
  calls_ = std::move(calls);
  room_ = room;
  return true;
}

bool SilentCalls::begin(std::uint32_t stream) {
  if (count_ == room_ && !grow()) return false;
  calls_[count_++] = Call{.stream = stream};
  return true;
}

void SilentCalls::note_time(Time now) {
  for (std::size_t i = count_; i > 0 && !calls_[i - 1].timed; --i) {
    calls_[i - 1].timed = true;
    calls_[i - 1].began = now;
  }
}

SilentCalls::Call* SilentCalls::find(std::uint32_t stream) {
  Call* const last = calls_.get() + count_;
  Call* const found =
      std::lower_bound(calls_.get(), last, stream,
                       [](const Call& call, std::uint32_t wanted) { return call.stream < wanted; });
  return found != last && found->stream == stream ? found : nullptr;
}

void SilentCalls::erase(std::size_t index) {
  Call* const call = calls_.get() + index;
  std::copy(call + 1, calls_.get() + count_, call);
  --count_;
}

void SilentCalls::end(std::uint32_t stream) {
  if (count_ == 0) return;
  if (const Call* call = find(stream)) erase(static_cast<std::size_t>(call - calls_.get()));
}

bool SilentCalls::begin_data(std::uint32_t stream) {
  if (count_ == 0) return false;
  const Call* call = find(stream);
  if (call == nullptr) return false;
  reading_ = static_cast<std::size_t>(call - calls_.get());
  return true;
}

bool SilentCalls::read(std::span<const std::uint8_t> bytes) {
  Call& call = calls_[reading_];
  while (call.prefix_bytes < kPrefixBytes && !bytes.empty()) {
    // The first byte says whether it is compressed.
    call.left = call.left << 8 | (call.prefix_bytes == 0 ? 0U : bytes.front());
    ++call.prefix_bytes;
    bytes = bytes.subspan(1);
  }
  call.left -= static_cast<std::uint32_t>(
      call.prefix_bytes < kPrefixBytes ? 0 : std::min<std::size_t>(call.left, bytes.size()));
  if (call.prefix_bytes < kPrefixBytes || call.left > 0) return true;
  erase(reading_);
  return false;
}

std::size_t SilentCalls::overdue(Time now) const {
  std::size_t count = count_ > most_ ? count_ - most_ : 0;
  while (count < count_ && calls_[count].timed && now - calls_[count].began > allowed_) ++count;
  return count;
}

std::uint32_t SilentCalls::take_oldest() {
  const std::uint32_t stream = calls_[0].stream;
  erase(0);
  return stream;
}

}  // namespace warmfront::server
