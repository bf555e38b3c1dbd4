// SPDX-License-Identifier: Apache-2.0
// How many connections an address may have, and begin.
#include "server/process/peers.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/un.h>

#include <cstring>
#include <string>
#include <thread>
#include <vector>

namespace warmfront::test {
namespace {

using server::Bucket;
using server::Peers;
using std::chrono::seconds;

Bucket::Clock::time_point peers_now;
Bucket::Clock::time_point peers_clock() {
  return peers_now;
}

std::optional<Peers::Place> enter(Peers& peers, const std::string& address) {
  sockaddr_in6 v6{};
  sockaddr_in v4{};
  if (inet_pton(AF_INET6, address.c_str(), &v6.sin6_addr) == 1) {
    v6.sin6_family = AF_INET6;
    return peers.enter(reinterpret_cast<const sockaddr*>(&v6), sizeof v6);
  }
  EXPECT_EQ(inet_pton(AF_INET, address.c_str(), &v4.sin_addr), 1);
  v4.sin_family = AF_INET;
  return peers.enter(reinterpret_cast<const sockaddr*>(&v4), sizeof v4);
}

std::vector<Peers::Place> enter_all(Peers& peers, const std::string& address, int tries) {
  std::vector<Peers::Place> places;
  for (int i = 0; i < tries; ++i)
    if (auto place = enter(peers, address)) places.push_back(std::move(*place));
  return places;
}

TEST(Peers, ConnectionsAreLimitedPerAddress) {
  Peers peers(10, &peers_clock);
  const auto mine = enter_all(peers, "192.0.2.1", 30);
  EXPECT_EQ(mine.size(), 10U);
  EXPECT_EQ(enter_all(peers, "192.0.2.2", 30).size(), 10U);
  EXPECT_FALSE(enter(peers, "::ffff:192.0.2.1")) << "the same client on a socket for both";
}

TEST(Peers, ClosedConnectionsFreeTheirPlacesAndNewOnesAreRateLimited) {
  Peers peers(10, &peers_clock);
  EXPECT_EQ(enter_all(peers, "192.0.2.1", 30).size(), 10U);
  EXPECT_FALSE(enter(peers, "192.0.2.1")) << "all have started just now";
  peers_now += seconds(3);
  EXPECT_EQ(enter_all(peers, "192.0.2.1", 30).size(), 3U) << "a tenth a second";
  peers_now += seconds(1000);
  EXPECT_LE(enter_all(peers, "192.0.2.1", 100).size(), 20U)
      << "unused connection starts are not carried over";
}

TEST(Peers, Ipv6AddressesOfOnePrefixAreOneAddress) {
  Peers peers(10, &peers_clock);
  const auto first = enter_all(peers, "2001:db8::1", 6);
  const auto second = enter_all(peers, "2001:db8::ffff:2", 6);
  EXPECT_EQ(first.size() + second.size(), 10U);
  EXPECT_TRUE(enter(peers, "2001:db8:0:1::1"));
}

TEST(Peers, UnixSocketsAndNoBoundAreNotCounted) {
  Peers peers(1, &peers_clock);
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::vector<Peers::Place> places;
  for (int i = 0; i < 100; ++i) {
    auto place = peers.enter(reinterpret_cast<const sockaddr*>(&name), sizeof name);
    ASSERT_TRUE(place);
    places.push_back(std::move(*place));
  }
  Peers unbounded(0, &peers_clock);
  EXPECT_EQ(enter_all(unbounded, "192.0.2.1", 100).size(), 100U);
  EXPECT_EQ(peers.size() + unbounded.size(), 0U);
}

// Whoever has many addresses does not fill the table: those that are gone are forgotten once they could begin
// as many as at first.
TEST(Peers, AddressesThatAreGoneAreForgotten) {
  Peers peers(10, &peers_clock);
  const auto kept = enter(peers, "198.51.100.1");
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 2000; ++i)
      EXPECT_TRUE(enter(peers, "10.0." + std::to_string(i / 250) + "." + std::to_string(i % 250)));
    peers_now += seconds(60);
  }
  EXPECT_LE(peers.size(), 5000U);
  EXPECT_EQ(enter_all(peers, "198.51.100.1", 30).size(), 9U) << "an address with a connection is remembered";
}

TEST(Peers, ThreadsTakeNoMoreThanThereAre) {
  Peers peers(50, &peers_clock);
  std::vector<std::vector<Peers::Place>> taken(4);
  std::vector<std::thread> threads;
  for (auto& mine : taken) threads.emplace_back([&] { mine = enter_all(peers, "192.0.2.9", 40); });
  for (std::thread& one : threads) one.join();
  std::size_t count = 0;
  for (const auto& mine : taken) count += mine.size();
  EXPECT_EQ(count, 50U);
}

}  // namespace
}  // namespace warmfront::test
