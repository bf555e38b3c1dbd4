// SPDX-License-Identifier: Apache-2.0
// recvmsg() and SSL_read() with a look at what came; close(), with which a connection's guard goes. Thread safety as stated in the header.
#include "server/process/guarded_receive.h"

#include <dlfcn.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <utility>

#include "server/process/peers.h"

namespace warmfront::server {
namespace {

std::atomic<bool> guarding{false};
Http2Guard::Bounds guard_bounds;  // set before `guarding`
int ssl_index = -1;               // likewise
std::array<std::atomic<std::uint64_t>, Http2Guard::kVerdicts> ended{};
std::atomic<std::uint64_t> refused{0};
Peers* peers = nullptr;  // as guard_bounds; never deleted, threads of gRPC use it until the process is gone

struct Connection {
  Http2Guard guard;
  Peers::Place place;
};

/// Connections by file number, in pages that are made when they are first needed and kept. One is made when
/// it is accepted, used by the one thread at a time that gRPC reads a connection on, and deleted when nothing
/// more comes, or when its file is closed.
class Connections {
 public:
  bool make(int file, Peers::Place place_of_peer) noexcept {
    std::atomic<Connection*>* place = find(file, true);
    auto* made = place == nullptr
                     ? nullptr
                     : new (std::nothrow) Connection{Http2Guard(guard_bounds), std::move(place_of_peer)};
    if (made == nullptr) return false;
    delete place->exchange(made, std::memory_order_acq_rel);
    return true;
  }
  Http2Guard* guard(int file) noexcept {
    const std::atomic<Connection*>* place = find(file, false);
    Connection* const one = place == nullptr ? nullptr : place->load(std::memory_order_acquire);
    return one == nullptr ? nullptr : &one->guard;
  }
  void drop(int file) noexcept {
    std::atomic<Connection*>* const place = find(file, false);
    // Most files are no connections.
    if (place != nullptr && place->load(std::memory_order_relaxed) != nullptr)
      delete place->exchange(nullptr, std::memory_order_acq_rel);
  }

 private:
  static constexpr std::size_t kPage = 1024, kPages = 1024;
  using Page = std::array<std::atomic<Connection*>, kPage>;

  std::atomic<Connection*>* find(int file, bool make) noexcept {
    const auto number = static_cast<std::size_t>(file);
    if (file < 0 || number >= kPage * kPages) return nullptr;
    std::atomic<Page*>& place = pages_[number / kPage];
    Page* page = place.load(std::memory_order_acquire);
    if (page == nullptr && make) {
      std::unique_ptr<Page> made(new (std::nothrow) Page{});
      if (made != nullptr && place.compare_exchange_strong(page, made.get())) page = made.release();
    }
    return page == nullptr ? nullptr : &(*page)[number % kPage];
  }

  std::array<std::atomic<Page*>, kPages> pages_{};
};

Connections connections;  // constant initialisation: there before the first thread, and used until the last is gone

/// Whether gRPC may have these bytes; counts the connection when it is the first time that it may not.
bool passes(Http2Guard& guard, std::span<const std::uint8_t> bytes) {
  const bool was_good = guard.verdict() == Http2Guard::kGood;
  const Http2Guard::Verdict verdict = guard.receive(bytes);
  if (was_good && verdict != Http2Guard::kGood) ended[verdict].fetch_add(1, std::memory_order_relaxed);
  return verdict == Http2Guard::kGood;
}

/// The same of so many bytes of a message, without those that were put there.
bool passes(Http2Guard& guard, const msghdr& message, std::size_t came, std::size_t put) {
  for (std::size_t i = 0; i < message.msg_iovlen && came > 0; ++i) {
    const std::size_t part = std::min(came, message.msg_iov[i].iov_len);
    const std::size_t ours = std::min(put, part);
    const std::span bytes(static_cast<const std::uint8_t*>(message.msg_iov[i].iov_base), part);
    if (ours < part && !passes(guard, bytes.subspan(ours))) return false;
    came -= part;
    put -= ours;
  }
  return true;
}

ssize_t receive_message(int file, msghdr* message, int flags) {
  return syscall(SYS_recvmsg, file, message, flags);
}

/// Where a message is received into, in parts that can be shifted.
class Places {
 public:
  static constexpr std::size_t kMost = 64;  // gRPC uses 4 at most

  explicit Places(const msghdr& message) : count_(message.msg_iovlen) {
    std::copy_n(message.msg_iov, count_, places_.begin());
  }
  iovec* data() { return places_.data(); }
  std::size_t count() const { return count_; }
  std::size_t space() const {
    std::size_t space = 0;
    for (std::size_t i = 0; i < count_; ++i) space += places_[i].iov_len;
    return space;
  }
  void skip(std::size_t bytes) {
    for (std::size_t i = 0; i < count_ && bytes > 0; ++i) {
      const std::size_t part = std::min(bytes, places_[i].iov_len);
      places_[i].iov_base = static_cast<std::uint8_t*>(places_[i].iov_base) + part;
      places_[i].iov_len -= part;
      bytes -= part;
    }
  }
  void keep(std::size_t bytes) {
    for (std::size_t i = 0; i < count_; ++i) {
      places_[i].iov_len = std::min(bytes, places_[i].iov_len);
      bytes -= places_[i].iov_len;
    }
  }
  void write(std::span<const std::uint8_t> bytes) {
    for (std::size_t i = 0; i < count_ && !bytes.empty(); ++i) {
      const std::size_t part = std::min(bytes.size(), places_[i].iov_len);
      std::copy_n(bytes.begin(), part, static_cast<std::uint8_t*>(places_[i].iov_base));
      bytes = bytes.subspan(part);
    }
  }

 private:
  std::array<iovec, kMost> places_{};
  std::size_t count_;
};

// So many bytes of RST_STREAM at once: 256 calls. The others follow at the next read.
constexpr std::size_t kMostResetBytes = std::size_t{256} * 13;

/// Takes less than came, or puts RST_STREAM before it, where the guard wants that: to gRPC it is as if the
/// client had sent these just before what it did send. `put` is how many bytes of what it returns are those.
/// What gRPC is told of more that waits in the socket (TCP_INQ) stays true, and where nothing came, nothing
/// is put there either: it goes on waiting for the next byte as ever.
ssize_t receive_beside_silent_calls(Http2Guard& guard, int file, msghdr* message, int flags,
                                    std::size_t& put) {
  Places places(*message), rest = places;
  const Http2Guard::NextRead next = guard.next_read(std::min(places.space(), SIZE_MAX / 2));
  const std::size_t resets = std::min(next.resets, kMostResetBytes);
  rest.skip(resets);
  if (next.resets == 0) rest.keep(next.most);
  iovec* const original = std::exchange(message->msg_iov, rest.data());
  const ssize_t came = receive_message(file, message, flags);
  const int error = errno;
  message->msg_iov = original;
  errno = error;
  if (came <= 0 || resets == 0) return came;
  std::array<std::uint8_t, kMostResetBytes> frames;
  guard.write_resets(std::span(frames).first(resets));
  places.write(std::span(frames).first(resets));
  put = resets;
  return came + static_cast<ssize_t>(resets);
}

void free_guard(void*, void* guard, CRYPTO_EX_DATA*, int, long, void*) {
  delete static_cast<Http2Guard*>(guard);
}

/// Null when there is no memory for it.
Http2Guard* guard_of(SSL* ssl) {
  auto* guard = static_cast<Http2Guard*>(SSL_get_ex_data(ssl, ssl_index));
  if (guard != nullptr) return guard;
  std::unique_ptr<Http2Guard> made(new (std::nothrow) Http2Guard(guard_bounds));
  if (made == nullptr || SSL_set_ex_data(ssl, ssl_index, made.get()) != 1) return nullptr;
  return made.release();
}

}  // namespace

void guard_connections(const Http2Guard::Bounds& bounds, std::uint32_t most_per_address) {
  guard_bounds = bounds;
  peers = new Peers(most_per_address);
  ssl_index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, &free_guard);
  guarding.store(true, std::memory_order_release);
}

bool guard_connection(int connection, const sockaddr* address, socklen_t length) noexcept {
  if (!guarding.load(std::memory_order_acquire)) return true;
  std::optional<Peers::Place> place = peers->enter(address, length);
  if (!place) refused.fetch_add(1, std::memory_order_relaxed);
  return place && connections.make(connection, std::move(*place));
}

std::uint64_t connections_refused() {
  return refused.load();
}

std::array<std::uint64_t, Http2Guard::kVerdicts> connections_ended() {
  std::array<std::uint64_t, Http2Guard::kVerdicts> counts{};
  std::ranges::transform(ended, counts.begin(), [](const auto& one) { return one.load(); });
  return counts;
}

}  // namespace warmfront::server

extern "C" ssize_t recvmsg(int file, msghdr* message, int flags) {
  using namespace warmfront::server;
  if (!guarding.load(std::memory_order_acquire) || (flags & (MSG_ERRQUEUE | MSG_PEEK)) != 0)
    return receive_message(file, message, flags);
  Http2Guard* guard = connections.guard(file);
  if (guard == nullptr) return receive_message(file, message, flags);
  std::size_t put = 0;
  const ssize_t came = guard->has_silent_calls() && message->msg_iovlen <= Places::kMost
                           ? receive_beside_silent_calls(*guard, file, message, flags, put)
                           : receive_message(file, message, flags);
  if (came <= 0) {
    const int error = errno;
    // gRPC reads no more from it.
    if (came == 0 || (error != EAGAIN && error != EINTR)) connections.drop(file);
    errno = error;
    return came;
  }
  if (passes(*guard, *message, static_cast<std::size_t>(came), put)) return came;
  shutdown(file, SHUT_RDWR);  // the client hears of it at once, whatever gRPC does
  return 0;
}

// gRPC closes a connection once nobody reads from it: also one that the daemon ended, or whose client vanished.
// Weak: a test has one of its own.
extern "C" [[gnu::weak]] int close(int file) {
  using namespace warmfront::server;
  if (guarding.load(std::memory_order_acquire)) connections.drop(file);
  return static_cast<int>(syscall(SYS_close, file));
}

extern "C" int SSL_read(SSL* ssl, void* buffer, int size) {
  using namespace warmfront::server;
  using Read = int (*)(SSL*, void*, int);
  static const auto next = reinterpret_cast<Read>(dlsym(RTLD_NEXT, "SSL_read"));
  if (size <= 0 || !guarding.load(std::memory_order_acquire) || SSL_is_server(ssl) == 0)
    return next(ssl, buffer, size);
  Http2Guard* guard = guard_of(ssl);
  auto* const bytes = static_cast<std::uint8_t*>(buffer);
  // As receive_beside_silent_calls() does.
  Http2Guard::NextRead read{0, static_cast<std::size_t>(size)};
  if (guard != nullptr && guard->has_silent_calls()) read = guard->next_read(read.most);
  const int came = next(ssl, bytes + read.resets, static_cast<int>(read.most));
  if (came <= 0) return came;
  const auto put = static_cast<int>(read.resets);
  if (put > 0) guard->write_resets({bytes, read.resets});
  if (guard != nullptr && passes(*guard, {bytes + put, static_cast<std::size_t>(came)}) &&
      !guard->encrypted())
    return came + put;
  // gRPC takes this for bytes that cannot be decrypted, and ends the connection.
  ERR_raise(ERR_LIB_SSL, SSL_R_BAD_DATA);
  return -1;
}
