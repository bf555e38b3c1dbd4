// SPDX-License-Identifier: Apache-2.0
// A TCP connection to a loopback port that sends arbitrary bytes, including HTTP/2 frames, and can end in any
// way. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace warmfront::test {

class RawSocket {
 public:
  /// Connects; see connected().
  explicit RawSocket(int port);
  ~RawSocket();
  RawSocket(RawSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  RawSocket& operator=(RawSocket&&) = delete;

  bool connected() const { return descriptor_ >= 0; }
  /// False once the other side closed. Gives up when the other side takes nothing for five seconds.
  bool send(const std::string& bytes) const;
  /// Reads until the other side closes, or `milliseconds` have passed without a byte: what came.
  std::string read_all(int milliseconds) const;
  /// Ends with a reset instead of a close.
  void reset();

 private:
  int descriptor_ = -1;
};

/// The parts of HTTP/2 (RFC 9113, RFC 7541) that a malicious client needs.
namespace http2 {

using Headers = std::vector<std::pair<std::string, std::string>>;

std::string frame(std::uint8_t type, std::uint8_t flags, std::uint32_t stream, const std::string& payload);
/// What every connection starts with: the preface and empty settings.
std::string hello();
/// Acknowledges the other side's settings.
std::string acknowledgement();
/// Literal fields without indexing or Huffman coding.
std::string header_block(const Headers& headers);
/// Those of a gRPC call of `path`, then `more`.
Headers call_headers(const std::string& path, const Headers& more = {});
/// HEADERS, and CONTINUATION where the block is longer than a frame may be.
std::string headers(std::uint32_t stream, const Headers& headers);
std::string reset_stream(std::uint32_t stream);
std::string ping();

}  // namespace http2
}  // namespace warmfront::test
