// SPDX-License-Identifier: Apache-2.0
// A stream's messages by packets beside gRPC, and the memory that goes with it. Used by one thread at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "client/lib/look.h"
#include "client/lib/shared_region.h"
#include "client/lib/spin_forecast.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

class PacketChannel {
 public:
  using Deadline = std::chrono::system_clock::time_point;
  enum class Event : std::uint8_t { kDone, kTimeout, kEnded };

  /// Binds the stream of which the daemon offered the token. Null where that cannot be, for whatever reason:
  /// the stream goes on without. Waits two seconds at most.
  static std::unique_ptr<PacketChannel> open(const std::string& path, const std::string& session_id,
                                             const std::string& token, std::uint64_t bytes);
  ~PacketChannel();
  PacketChannel(const PacketChannel&) = delete;
  PacketChannel& operator=(const PacketChannel&) = delete;

  /// Whose blocks frames may be in.
  const std::shared_ptr<SharedRegion>& region() const { return region_; }
  /// Asks for so much memory in place of what there is, while no frame is unanswered. Where it is refused,
  /// the region is as before, and this does nothing from then on.
  void ask_for(std::uint64_t bytes);

  /// A message of kMostPacketBytes at most.
  Event send(const std::vector<std::string_view>& pieces, Deadline deadline);
  /// `look` as next_event() has it.
  Event receive(v1::StreamStepsResponse& response, Deadline deadline, const Look& look);

 private:
  explicit PacketChannel(int socket) : socket_(socket) {}
  bool take_memory(const v1::SharedMemoryRequest& request);
  static constexpr ssize_t kNothing = -1;
  /// The length of the next packet, where it has come; 0: the end of them, or an error.
  ssize_t receive_now(int* file = nullptr);
  /// Waits for it until the deadline.
  ssize_t await(Deadline deadline, const Look& look);
  /// The same, without sleeping.
  ssize_t spin(std::chrono::steady_clock::time_point until);

  const int socket_;
  std::shared_ptr<SharedRegion> region_;
  bool refused_ = false;
  SpinForecast forecast_;
  std::vector<char> packet_;
};

}  // namespace warmfront::client
