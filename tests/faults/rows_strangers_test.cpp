// SPDX-License-Identifier: Apache-2.0
// Fault table, row 29: clients without a token, while another session is stepped.
#include <arpa/inet.h>
#include <openssl/ssl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <thread>

#include "tests/faults/fault_table.h"
#include "tests/faults/raw_socket.h"
#include "tests/unit/server/test_certificates.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;

/// A daemon without a token file: strangers' HTTP/2 is looked at before anybody's token.
class FaultTableStrangers : public FaultTable {
 protected:
  /// Steps the untouched session alone, while `attack` runs in a thread of its own, and a few times more.
  void while_stepping(const char* what, const std::function<void()>& attack) {
    steps_alone();
    std::atomic<bool> done{false};
    std::thread attacking([&] {
      compute_elsewhere();
      attack();
      done = true;
    });
    steps_beside(what, 20, [&] { return done.load(); });
    attacking.join();
    for (int i = 0; i < 20; ++i) step_untouched();
  }

  /// Simulates clients on other machines: the calling thread's work does not take the daemon's cores.
  static void compute_elsewhere() { setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 19); }

  /// Sends `part` on every socket repeatedly, until all were closed or `megabytes` were sent.
  static std::size_t send_until_ended(std::vector<RawSocket>& sockets, std::size_t megabytes,
                                      const std::function<std::string()>& part) {
    std::vector<bool> open(sockets.size(), true);
    std::size_t sent = 0;
    while (std::ranges::count(open, true) > 0 && sent < megabytes * kMiB)
      for (std::size_t i = 0; i < sockets.size(); ++i) {
        if (!open[i]) continue;
        const std::string bytes = part();
        open[i] = sockets[i].send(bytes);
        if (open[i]) sent += bytes.size();
      }
    EXPECT_EQ(std::ranges::count(open, true), 0) << "the attackers' connections are ended";
    std::printf("%.1f MiB were taken before the end\n", static_cast<double>(sent) / kMiB);
    return sent;
  }

  /// Counted from the log, which has one line of it a second.
  void expect_reason(const char* reason) const {
    for (int i = 0; i < 300 && daemon_->log().find(reason) == std::string::npos; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_NE(daemon_->log().find(reason), std::string::npos) << "the log says why";
  }

  std::vector<RawSocket> connections(std::size_t count,
                                     const std::string& acknowledgement = http2::acknowledgement()) const {
    std::vector<RawSocket> sockets;
    for (std::size_t i = 0; i < count; ++i) {
      sockets.emplace_back(daemon_->port());
      EXPECT_TRUE(sockets.back().send(http2::hello() + acknowledgement));
    }
    return sockets;
  }
};

const std::string kStep = "/warmfront.v1.CollisionService/Step";

TEST_F(FaultTableStrangers, Row29_ContinuationWithoutEnd) {
  const std::string part = http2::frame(9, 0, 1, http2::header_block({{"more", std::string(16'000, 'm')}}));
  while_stepping("CONTINUATION without end", [&] {
    std::vector<RawSocket> sockets = connections(2);
    for (const RawSocket& socket : sockets)
      socket.send(http2::frame(1, 0, 1, http2::header_block(http2::call_headers(kStep))));
    send_until_ended(sockets, 1024, [&] { return part; });
  });
  expect_reason("header_block");
}

TEST_F(FaultTableStrangers, Row29_AnIntegerWithoutEnd) {
  const std::string part = http2::frame(9, 0, 1, std::string(16'000, '\x80'));
  while_stepping("an integer without end", [&] {
    std::vector<RawSocket> sockets = connections(4);
    for (const RawSocket& socket : sockets) socket.send(http2::frame(1, 0, 1, "\x7f\x80"));
    send_until_ended(sockets, 64, [&] { return part; });
  });
  expect_reason("field_coding");
}

TEST_F(FaultTableStrangers, Row29_RapidReset) {
  std::uint32_t stream = 1;
  while_stepping("calls that are reset at once", [&] {
    std::vector<RawSocket> sockets = connections(2);
    send_until_ended(sockets, 64, [&] {
      std::string bytes;
      for (int i = 0; i < 100; ++i, stream += 2)
        bytes += http2::headers(stream, http2::call_headers(kStep)) + http2::reset_stream(stream);
      return bytes;
    });
  });
  expect_reason("resets");
}

/// Encrypts what it sends over a socket that is connected.
class TlsConnection {
 public:
  explicit TlsConnection(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    constexpr std::array<unsigned char, 3> kHttp2{2, 'h', '2'};
    SSL_set_alpn_protos(ssl_.get(), kHttp2.data(), kHttp2.size());
    SSL_set_fd(ssl_.get(), socket_);
    EXPECT_EQ(SSL_connect(ssl_.get()), 1);
  }
  ~TlsConnection() { ::close(socket_); }
  TlsConnection(const TlsConnection&) = delete;
  TlsConnection& operator=(const TlsConnection&) = delete;
  bool send(const std::string& bytes) const {
    return SSL_write(ssl_.get(), bytes.data(), static_cast<int>(bytes.size())) > 0;
  }

 private:
  const int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context_{SSL_CTX_new(TLS_client_method()), SSL_CTX_free};
  const std::unique_ptr<SSL, void (*)(SSL*)> ssl_{SSL_new(context_.get()), SSL_free};
};

/// Flags of a daemon with a certificate, which is put into the folder.
std::vector<std::string> certified(const TemporaryFolder& folder, std::vector<std::string> flags = {}) {
  const Certificate mine("localhost", nullptr, "IP:127.0.0.1");
  std::ofstream(folder.path() / "certificate") << mine.certificate();
  std::ofstream(folder.path() / "key") << mine.key();
  flags.insert(flags.end(), {"--tls-cert", (folder.path() / "certificate").string(), "--tls-key",
                             (folder.path() / "key").string()});
  signal(SIGPIPE, SIG_IGN);
  return flags;
}

TEST_F(FaultTableStrangers, Row29_ContinuationWithoutEndUnderTls) {
  const TemporaryFolder folder;
  begin(certified(folder));
  const std::string part = http2::frame(9, 0, 1, http2::header_block({{"more", std::string(8'000, 'm')}}));
  while_stepping("CONTINUATION without end under TLS", [&] {
    const TlsConnection connection(daemon_->port());
    ASSERT_TRUE(connection.send(http2::hello()));
    bool open = connection.send(http2::frame(1, 0, 1, http2::header_block(http2::call_headers(kStep))));
    int sent = 0;
    for (; open && sent < 50'000; ++sent) open = connection.send(part);
    EXPECT_FALSE(open) << "the connection is ended";
    std::printf("%d frames were taken before the end\n", sent);
  });
  expect_reason("header_block");
}

/// Rounds of calls without a message on connections that stay open, and are allowed 128 calls at once: where
/// those of a round are not ended, the next round ends the connection. Where that was; empty where it was
/// not.
template <class Connection>
std::string silent_rounds(int port, std::chrono::seconds wait,
                          std::vector<std::unique_ptr<Connection>>& connections) {
  connections.clear();
  for (int i = 0; i < 4; ++i) {
    connections.push_back(std::make_unique<Connection>(port));
    // At once: whoever says nothing for ten seconds is ended, and on a busy machine the others take as long.
    if (!connections.back()->send(http2::hello() + http2::acknowledgement()))
      return "connection " + std::to_string(i) + " had ended before it began";
  }
  const auto ended = [&](const std::string& bytes, const std::string& where) {
    for (std::size_t i = 0; i < connections.size(); ++i)
      if (!connections[i]->send(bytes)) return "connection " + std::to_string(i) + " had ended " + where;
    return std::string();
  };
  std::uint32_t stream = 1;
  for (int round = 0; round < 4; ++round) {
    const std::string of_round = "in round " + std::to_string(round);
    // Every other call sends part of a message.
    for (int i = 0; i < 100; ++i, stream += 2) {
      const std::string call =
          http2::headers(stream, http2::call_headers(kStep)) +
          (i % 2 == 0 ? "" : http2::frame(0, 0, stream, std::string("\0\0\0\0\x09 12", 8)));
      if (std::string why = ended(call, of_round + ", call " + std::to_string(i)); !why.empty()) return why;
    }
    constexpr std::chrono::milliseconds kPause{50};
    for (std::chrono::milliseconds waited{0}; waited < wait; waited += kPause) {
      std::this_thread::sleep_for(kPause);
      const std::string update = http2::frame(8, 0, 0, std::string("\0\0\0\1", 4));
      if (std::string why = ended(update, of_round + ", after " + std::to_string(waited.count()) + " ms");
          !why.empty())
        return why;
    }
  }
  return {};
}

/// A daemon on a machine that is busy is given more time.
template <class Connection>
std::vector<std::unique_ptr<Connection>> expect_silent_calls_end(int port) {
  std::vector<std::unique_ptr<Connection>> connections;
  if (const std::string first = silent_rounds(port, std::chrono::seconds(3), connections); !first.empty()) {
    EXPECT_EQ(silent_rounds(port, std::chrono::seconds(20), connections), "")
        << "a round's calls are ended before the next round; with 3 s for each, " << first;
  }
  return connections;
}

TEST_F(FaultTableStrangers, Row29_SilentCalls) {
  begin({"--upload-timeout", "500ms"});
  allowed_growth_ = 16 * kMiB;
  while_stepping("calls without a message", [&] {
    const auto connections = expect_silent_calls_end<RawSocket>(daemon_->port());
    // They are still open when memory is measured.
    EXPECT_TRUE(kSanitized || growth_once_within(allowed_growth_) <= allowed_growth_);
  });
}

TEST_F(FaultTableStrangers, Row29_SilentCallsUnderTls) {
  const TemporaryFolder folder;
  begin(certified(folder, {"--upload-timeout", "500ms"}));
  allowed_growth_ = 16 * kMiB;
  while_stepping("calls without a message under TLS", [&] {
    const auto connections = expect_silent_calls_end<TlsConnection>(daemon_->port());
    EXPECT_TRUE(kSanitized || growth_once_within(allowed_growth_) <= allowed_growth_);
  });
}

// gRPC enforces its limit on calls once the client has acknowledged it.
TEST_F(FaultTableStrangers, Row29_CallsBeforeTheSettingsAreAcknowledged) {
  std::uint32_t stream = 1;
  while_stepping("calls of a client that acknowledges no settings", [&] {
    std::vector<RawSocket> sockets = connections(2, "");
    send_until_ended(sockets, 16, [&] {
      std::string bytes;
      for (int i = 0; i < 100; ++i, stream += 2) bytes += http2::headers(stream, http2::call_headers(kStep));
      return bytes;
    });
  });
  expect_reason("\"calls\"");
}

// A frame sent byte by byte: nothing can be inserted before its end, which never comes.
TEST_F(FaultTableStrangers, Row29_SilentCallsBehindAFrameThatDrips) {
  begin({"--upload-timeout", "500ms"});
  while_stepping("calls without a message behind a frame that drips", [&] {
    std::vector<RawSocket> sockets = connections(1);
    sockets[0].send(http2::headers(1, http2::call_headers(kStep)) +
                    http2::frame(0, 1, 1, std::string(16'000, 'x')).substr(0, 20));
    bool open = true;
    for (int i = 0; i < 600 && open; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      open = sockets[0].send("x");
    }
    EXPECT_FALSE(open) << "the connection is ended";
  });
  expect_reason("silent_calls");
}

/// A watch of the whole daemon, as a call of this number.
std::string watch(std::uint32_t stream) {
  return http2::headers(stream, http2::call_headers("/grpc.health.v1.Health/Watch")) +
         http2::frame(0, 1, stream, std::string(5, '\0'));
}

// Each holds memory while it is open, without authentication.
TEST_F(FaultTableStrangers, Row29_HealthWatches) {
  allowed_growth_ = 24 * kMiB;
  while_stepping("health watches", [&] {
    std::vector<RawSocket> sockets = connections(20);
    for (const RawSocket& socket : sockets)
      for (std::uint32_t stream = 1; stream < 200; stream += 2) EXPECT_TRUE(socket.send(watch(stream)));
    for (const RawSocket& socket : sockets) socket.read_all(200);
    EXPECT_TRUE(kSanitized || growth_once_within(allowed_growth_) <= allowed_growth_);
    EXPECT_EQ(health(), 1);
  });
}

// More than an address may have are closed at once, and its places are free again when its connections are
// gone.
TEST_F(FaultTableStrangers, Row29_ConnectionsOfOneAddress) {
  begin({"--max-connections-per-address", "20"});
  while_stepping("connections of one address", [&] {
    const auto expect_open = [&](std::size_t count) {
      std::vector<RawSocket> sockets = connections(count);
      for (const RawSocket& socket : sockets) EXPECT_NE(socket.read_all(200), "") << "the daemon's settings";
      return sockets;
    };
    {
      const std::vector<RawSocket> sockets = expect_open(20);
      for (int i = 0; i < 20; ++i)
        EXPECT_EQ(RawSocket(daemon_->port()).read_all(10'000), "") << "closed without an answer";
    }
    // In two seconds four may begin.
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
    expect_open(4);
  });
  expect_reason("max-connections-per-address");
}

// A message that honest callers could send, too, of many empty ones: refused by its parsed size, whoever
// sends it, and four at once hold no more than one may.
TEST_F(FaultTableStrangers, Row29_MessagesOfEmptyMessages) {
  // Room for all of them in transit, as by default: without it gRPC ends calls that it has no memory for,
  // whosever they are. On a machine that is busy with all of them a message takes longer than a minute.
  begin({"--transport-memory", "256MiB", "--write-stall-timeout", "10m"});
  // Those that are refused hold their bytes, in gRPC, and nothing else.
  allowed_peak_ = 256 * kMiB;
  std::string changes;
  for (std::size_t i = 0; i < 15 * kMiB; ++i) changes += std::string("\x1a\x00", 2);
  std::string bodies("\x0a", 1);
  for (std::size_t left = changes.size(); left > 0; left >>= 7)
    bodies += static_cast<char>((left & 127) | (left >= 128 ? 128 : 0));
  for (std::size_t i = 0; i < 15 * kMiB; ++i) bodies += std::string("\x32\x00", 2);
  while_stepping("messages of empty messages", [&] {
    std::vector<std::thread> callers;
    for (int i = 0; i < 4; ++i)
      callers.emplace_back([&, i] {
        compute_elsewhere();
        for (int round = 0; round < 5; ++round) {
          const grpc::Status status =
              i % 2 == 0 ? raw_call("ChangeScene", {changes}) : raw_call("CreateSession", {bodies});
          EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
        }
      });
    for (std::thread& caller : callers) caller.join();
  });
}

}  // namespace
}  // namespace warmfront::test
