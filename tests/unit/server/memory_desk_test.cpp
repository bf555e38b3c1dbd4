// SPDX-License-Identifier: Apache-2.0
// A desk of shared memory that ends while strangers come.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <thread>

#include "server/transport/stream_memory.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/packet_client.h"

namespace warmfront::server {
namespace {

class NoStream final : public SharesMemory {
 public:
  bool bind(const std::shared_ptr<PacketConnection>&, const v1::SharedMemoryRequest&) override {
    return false;
  }
  bool packet(const std::shared_ptr<PacketConnection>&, std::string_view) noexcept override { return false; }
  void has_room(const std::shared_ptr<PacketConnection>&) noexcept override {}
  void lost(const std::shared_ptr<PacketConnection>&) noexcept override {}
};

// Whoever is being told of then still needs the sockets.
TEST(MemoryDesk, EndsWhileAStreamIsBeingBound) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "w.sock").string();
  const auto stream = std::make_shared<NoStream>();
  std::mt19937 random(7);
  for (int round = 0; round < 400; ++round) {
    auto desk = MemoryDesk::start({path}, 2, PacketWait::kLater);
    ASSERT_TRUE(desk.ok());
    v1::StreamStepsRequest request;
    request.mutable_shared_memory()->set_session_id("s");
    request.mutable_shared_memory()->set_token(desk.value()->offer(stream));
    request.mutable_shared_memory()->set_bytes(4096);
    test::PacketClient client("unix:" + path);
    ASSERT_TRUE(client.connected());
    ASSERT_TRUE(client.send(request));
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 150));
    desk.value().reset();
  }
}

}  // namespace
}  // namespace warmfront::server
