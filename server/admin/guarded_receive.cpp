// SPDX-License-Identifier: Apache-2.0
// recvmsg() and SSL_read() with a look at what came. Thread safety as stated in the header.
#include "server/admin/guarded_receive.h"

#include <dlfcn.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <memory>
#include <new>
#include <span>

namespace warmfront::server {
namespace {

std::atomic<bool> guarding{false};
std::size_t metadata_bytes = 0;  // set before `guarding`
int ssl_index = -1;              // likewise
std::array<std::atomic<std::uint64_t>, Http2Guard::kVerdicts> ended{};

/// Guards by file number, in pages that are made when they are first needed and kept. A guard is made when
/// its connection is accepted, used by the one thread at a time that gRPC reads a connection on, and deleted
/// when the connection ends or its number is accepted again.
class Guards {
 public:
  bool make(int file) noexcept {
    std::atomic<Http2Guard*>* place = find(file, true);
    auto* guard = place == nullptr ? nullptr : new (std::nothrow) Http2Guard(metadata_bytes);
    if (guard == nullptr) return false;
    delete place->exchange(guard, std::memory_order_acq_rel);
    return true;
  }
  Http2Guard* get(int file) noexcept {
    const std::atomic<Http2Guard*>* place = find(file, false);
    return place == nullptr ? nullptr : place->load(std::memory_order_acquire);
  }
  void drop(int file) noexcept {
    if (std::atomic<Http2Guard*>* place = find(file, false)) delete place->exchange(nullptr);
  }

 private:
  static constexpr std::size_t kPage = 1024, kPages = 1024;
  using Page = std::array<std::atomic<Http2Guard*>, kPage>;

  std::atomic<Http2Guard*>* find(int file, bool make) noexcept {
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

Guards guards;  // constant initialisation: there before the first thread, and used until the last is gone

/// Whether gRPC may have these bytes; counts the connection when it is the first time that it may not.
bool passes(Http2Guard& guard, std::span<const std::uint8_t> bytes) {
  const bool was_good = guard.verdict() == Http2Guard::kGood;
  const Http2Guard::Verdict verdict = guard.receive(bytes);
  if (was_good && verdict != Http2Guard::kGood) ended[verdict].fetch_add(1, std::memory_order_relaxed);
  return verdict == Http2Guard::kGood;
}

/// The same of so many bytes of a message.
bool passes(Http2Guard& guard, const msghdr& message, std::size_t came) {
  for (std::size_t i = 0; i < message.msg_iovlen && came > 0; ++i) {
    const std::size_t part = std::min(came, message.msg_iov[i].iov_len);
    if (!passes(guard, {static_cast<const std::uint8_t*>(message.msg_iov[i].iov_base), part})) return false;
    came -= part;
  }
  return true;
}

void free_guard(void*, void* guard, CRYPTO_EX_DATA*, int, long, void*) {
  delete static_cast<Http2Guard*>(guard);
}

/// Null when there is no memory for it.
Http2Guard* guard_of(SSL* ssl) {
  auto* guard = static_cast<Http2Guard*>(SSL_get_ex_data(ssl, ssl_index));
  if (guard != nullptr) return guard;
  std::unique_ptr<Http2Guard> made(new (std::nothrow) Http2Guard(metadata_bytes));
  if (made == nullptr || SSL_set_ex_data(ssl, ssl_index, made.get()) != 1) return nullptr;
  return made.release();
}

}  // namespace

void guard_connections(std::size_t max_metadata_bytes) {
  metadata_bytes = max_metadata_bytes;
  ssl_index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, &free_guard);
  guarding.store(true, std::memory_order_release);
}

bool guard_connection(int connection) noexcept {
  return !guarding.load(std::memory_order_acquire) || guards.make(connection);
}

std::array<std::uint64_t, Http2Guard::kVerdicts> connections_ended() {
  std::array<std::uint64_t, Http2Guard::kVerdicts> counts{};
  std::ranges::transform(ended, counts.begin(), [](const auto& one) { return one.load(); });
  return counts;
}

}  // namespace warmfront::server

extern "C" ssize_t recvmsg(int file, msghdr* message, int flags) {
  using namespace warmfront::server;
  const ssize_t came = syscall(SYS_recvmsg, file, message, flags);
  if (!guarding.load(std::memory_order_acquire) || (flags & (MSG_ERRQUEUE | MSG_PEEK)) != 0) return came;
  Http2Guard* guard = guards.get(file);
  if (guard == nullptr) return came;
  if (came <= 0) {
    const int error = errno;
    // gRPC reads no more from it.
    if (came == 0 || (error != EAGAIN && error != EINTR)) guards.drop(file);
    errno = error;
    return came;
  }
  if (passes(*guard, *message, static_cast<std::size_t>(came))) return came;
  shutdown(file, SHUT_RDWR);  // the client hears of it at once, whatever gRPC does
  return 0;
}

extern "C" int SSL_read(SSL* ssl, void* buffer, int size) {
  using namespace warmfront::server;
  using Read = int (*)(SSL*, void*, int);
  static const auto next = reinterpret_cast<Read>(dlsym(RTLD_NEXT, "SSL_read"));
  const int came = next(ssl, buffer, size);
  if (came <= 0 || !guarding.load(std::memory_order_acquire) || SSL_is_server(ssl) == 0) return came;
  Http2Guard* guard = guard_of(ssl);
  const std::span bytes(static_cast<const std::uint8_t*>(buffer), static_cast<std::size_t>(came));
  if (guard != nullptr && passes(*guard, bytes) && !guard->encrypted()) return came;
  // gRPC takes this for bytes that cannot be decrypted, and ends the connection.
  ERR_raise(ERR_LIB_SSL, SSL_R_BAD_DATA);
  return -1;
}
