// SPDX-License-Identifier: Apache-2.0
// Counting calls. Thread safety as stated in the header.
#include "client/lib/channel_pool.h"

#include <algorithm>
#include <utility>

namespace warmfront::client {

ChannelPool::Lease::~Lease() {
  if (channel_ == nullptr) return;
  const std::lock_guard lock(pool_->mutex_);
  --channel_->calls;
}

ChannelPool::Lease ChannelPool::take() {
  const std::lock_guard lock(mutex_);
  auto found = std::ranges::find_if(channels_, [&](const auto& one) { return one->calls < most_calls_; });
  if (found == channels_.end()) {
    auto made = std::make_unique<Channel>();
    made->channel = open_();
    made->service = v1::CollisionService::NewStub(made->channel);
    made->admin = v1::AdminService::NewStub(made->channel);
    channels_.push_back(std::move(made));
    found = channels_.end() - 1;
  }
  ++(*found)->calls;
  return {*this, **found};
}

void ChannelPool::set_calls_per_channel(std::uint32_t most) {
  const std::lock_guard lock(mutex_);
  most_calls_ = most == 0 ? kMostCalls : std::min(most, kMostCalls);
}

}  // namespace warmfront::client
