// SPDX-License-Identifier: Apache-2.0
// Counting connections by address. Thread safety as stated in the header.
#include "server/process/peers.h"

#include <netinet/in.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <random>

namespace warmfront::server {
namespace {

using Key = std::array<std::uint8_t, 16>;

constexpr Key kIpv4{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};  // ::ffff:a.b.c.d (RFC 4291, 2.5.5.2)

std::optional<Key> key_of(const sockaddr* address, socklen_t length) {
  if (address->sa_family == AF_INET && length >= sizeof(sockaddr_in)) {
    Key key = kIpv4;
    std::memcpy(key.data() + 12, &reinterpret_cast<const sockaddr_in*>(address)->sin_addr, 4);
    return key;
  }
  if (address->sa_family == AF_INET6 && length >= sizeof(sockaddr_in6)) {
    Key key;
    std::memcpy(key.data(), &reinterpret_cast<const sockaddr_in6*>(address)->sin6_addr, key.size());
    // An IPv4 client of a socket for both stays one address.
    if (!std::equal(kIpv4.begin(), kIpv4.begin() + 12, key.begin())) std::fill(key.begin() + 8, key.end(), 0);
    return key;
  }
  return std::nullopt;
}

}  // namespace

// Strangers choose addresses: where they fall in the table they cannot foresee.
std::size_t Peers::Hash::operator()(const Place::Key& key) const noexcept {
  static const std::uint64_t secret = std::random_device{}() | std::uint64_t{std::random_device{}()} << 32;
  std::uint64_t hash = secret;
  for (const std::uint8_t byte : key) hash = (hash ^ byte) * 0x9e3779b97f4a7c15U, hash ^= hash >> 29;
  return hash;
}

std::optional<Peers::Place> Peers::enter(const sockaddr* address, socklen_t length) noexcept try {
  if (most_ == 0) return Place();
  const std::optional<Key> key = key_of(address, length);
  if (!key) return Place();
  const MutexLock lock(mutex_);
  if (peers_.size() >= forget_at_) forget();
  const std::uint32_t per_second = std::max(most_ / 10, 1U);
  Peer& peer = peers_.try_emplace(*key, Peer{0, Bucket(most_, per_second, now_())}).first->second;
  if (peer.connections >= most_ || !peer.begun.take(1, now_)) return std::nullopt;
  ++peer.connections;
  return Place(*this, *key);
} catch (const std::bad_alloc&) {
  return std::nullopt;
}

void Peers::leave(const Place::Key& key) noexcept {
  const MutexLock lock(mutex_);
  --peers_.find(key)->second.connections;
}

/// Those without connections that began none for some time. What is left has connections, which files bound,
/// or began them within ten seconds; so each address is looked at a bounded number of times.
void Peers::forget() {
  const Bucket::Clock::time_point now = now_();
  std::erase_if(peers_, [&](const auto& one) { return one.second.connections == 0 && one.second.begun.full(now); });
  forget_at_ = std::max<std::size_t>(1024, 2 * peers_.size());
}

std::size_t Peers::size() const {
  const MutexLock lock(mutex_);
  return peers_.size();
}

}  // namespace warmfront::server
